// value_limits.h: how far and how loud anything in a bake file may be, so that sums stay finite.
#pragma once

namespace clamor {

inline constexpr float kMaxCoordinateInFile_m = 2e6f;
inline constexpr float kMaxPowerInFile = 1e30f;

}  // namespace clamor
