// presentation_room.h: the violin performance of the paper's section 5.2, built anew.
//
// A furnished presentation room of 9 x 3.6 x 12 m: a podium with a grand piano, a lectern and a
// violinist who faces forty upholstered chairs; curtained windows, panelling, a tiled ceiling.
#pragma once

#include <string>

namespace clamor::assets {

// The .glb; plays sounds/violin.flac.
std::string make_presentation_room();

}  // namespace clamor::assets
