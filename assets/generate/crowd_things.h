// crowd_things.h: what a crowd makes noise with besides its voice.
#pragma once

#include "sound.h"

namespace clamor::assets {

Samples whistle_fingers();  // two fingers in the mouth: up, hold, away
Samples whistle_pea();      // a referee's, with the trill of its pea
Samples claps_regular();    // two a second
Samples claps_fast();       // applause, about seven a second
Samples horn();             // a plastic trumpet on B flat
Samples drum();             // a bass drum, boom boom, boom-boom-boom

}  // namespace clamor::assets
