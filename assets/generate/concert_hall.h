// concert_hall.h: a concert hall of smooth surfaces, in which seeds and numbers of photons matter.
//
// A shoebox of 20 x 15 x 40 m with a stage, forty-eight rows of seats, galleries, niches in the
// side walls and a coffered ceiling, of about a thousand triangles. All surfaces scatter a tenth of
// what they reflect, and most absorption is on the floor, so that sound stays long between the
// walls.
#pragma once

#include <string>

namespace clamor::assets {

// The .glb; plays sounds/violin.flac.
std::string make_concert_hall();

}  // namespace clamor::assets
