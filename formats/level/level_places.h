// level_places.h: checks that everything in a level is where it can matter.
#pragma once

#include <string>
#include <vector>

#include "common/result.h"

namespace clamor {

struct Level;

// An Error that names what lies more than 1000 km from the level's origin: places that are given in
// sidecars, on the command line and by applications may lie anywhere in the world.
Result<void> check_places(const Level& level);

// An Error where a surface lies that far away. Levels of applications need it; the vertices of
// files are checked as they are read.
Result<void> check_surfaces(const Level& level);

// Warnings of portals that lie beyond all that sounds, reflects or moves, so that no path passes
// them: their places are in another unit or frame than the level.
std::vector<std::string> warnings_of_far_portals(const Level& level);

}  // namespace clamor
