// stadium_walk.h: the walk of the paper's section 5.1: from the middle of the pitch up the stairs
// into the fans.
#pragma once

#include <string>

namespace clamor::assets {

// The walk file.
std::string make_stadium_walk();

}  // namespace clamor::assets
