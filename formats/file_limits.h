// file_limits.h: how far and how loud anything in a bake file may be, so that sums stay finite.
#pragma once

namespace clamor {

inline constexpr float kFarthestInFile_m = 2e6f;
inline constexpr float kMostPowerInFile = 1e30f;

}  // namespace clamor
