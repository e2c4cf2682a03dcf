// crowd_things.h: whistles, claps, horns and drums of a crowd, one utterance of each.
#pragma once

#include "sound.h"

namespace clamor::assets {

Samples whistle_fingers(const Variation& how);  // two fingers in the mouth: up, hold, away
Samples whistle_pea(const Variation& how);      // a referee's, with the trill of its pea
Samples claps_regular(const Variation& how);    // two a second
Samples claps_fast(const Variation& how);       // applause, about seven a second
Samples horn(const Variation& how);             // a plastic trumpet on B flat
Samples drum(const Variation& how);             // a bass drum, boom boom, boom-boom-boom

}  // namespace clamor::assets
