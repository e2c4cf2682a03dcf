// path_segment.h: straight segments of paths, and how many are cast at once.
#pragma once

#include <cstddef>

#include "common/vec.h"

namespace clamor {

struct PathSegment {
  Vec3f from_m{}, to_m{};
};

// Segments that are cast at once.
inline constexpr std::size_t kPacketRays = 16;

}  // namespace clamor
