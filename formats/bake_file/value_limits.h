// value_limits.h: limits of coordinates and powers in a bake file, so that sums stay finite.
#pragma once

namespace clamor {

inline constexpr float kMaxCoordinateInFile_m = 2e6f;
inline constexpr float kMaxPowerInFile = 1e30f;

}  // namespace clamor
