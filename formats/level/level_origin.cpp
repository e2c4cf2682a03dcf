#include "formats/level/level_origin.h"

#include <cmath>

#include <fmt/format.h>

namespace clamor {

Vec3 in_level(const Vec3& place_m, const Vec3& origin_m) {
  constexpr double kFarthest_m = 1e6;
  for (int axis = 0; axis < 3; ++axis)
    if (!(std::abs(place_m[axis]) <= kMaxWorldCoordinate_m)) return place_m;
  return glm::clamp(place_m - origin_m, Vec3(-kFarthest_m), Vec3(kFarthest_m));
}

std::string place_in_words(const Vec3& place_m) {
  std::string text;
  for (int i = 0; i < 3; ++i) {
    const double at_m = place_m[i] + 0.0;  // without a minus before 0
    text += i > 0 ? "," : "";
    text += std::abs(at_m) < 1000 ? fmt::format("{:.6g}", at_m) : fmt::format("{:.2f}", at_m);
  }
  return text;
}

Vec3 level_origin_m(const Vec3& middle_m) {
  constexpr double kNear_m = 500, kGrid_m = 100;
  const double from_m = length(middle_m);
  if (!(from_m > kNear_m && from_m <= kMaxWorldCoordinate_m)) return Vec3(0);
  return glm::round(middle_m / kGrid_m) * kGrid_m;
}

}  // namespace clamor
