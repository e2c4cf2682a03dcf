#include "runtime/occlusion/changed_parts.h"

#include <algorithm>
#include <cmath>

namespace clamor {

namespace {

constexpr std::size_t kBlock = 32;  // spheres that are tested at a time

float distance_m(const PartBounds& box, const Vec3f& point_m) {
  return glm::length(glm::max(glm::max(box.low_m - point_m, point_m - box.high_m), Vec3f(0)));
}

// Returns whether the segment meets the box, enlarged by `margin_m` on all sides.
bool meets(const PartBounds& box, const Vec3f& from_m, const Vec3f& to_m, float margin_m) {
  const Vec3f along_m = to_m - from_m;
  float enter = 0, leave = 1;
  for (glm::length_t axis = 0; axis < 3; ++axis) {
    const float low_m = box.low_m[axis] - margin_m - from_m[axis];
    const float high_m = box.high_m[axis] + margin_m - from_m[axis];
    if (std::abs(along_m[axis]) < 1e-9f) {
      if (low_m > 0 || high_m < 0) return false;
      continue;
    }
    const float a = low_m / along_m[axis], b = high_m / along_m[axis];
    enter = std::max(enter, std::min(a, b));
    leave = std::min(leave, std::max(a, b));
  }
  return enter <= leave;
}

}  // namespace

void ChangedParts::add(std::span<const PartBounds> bounds) {
  for (const PartBounds& box : bounds) {
    const Vec3f centre_m = 0.5f * (box.low_m + box.high_m);
    boxes_.push_back(box);
    x_m_.push_back(centre_m.x);
    y_m_.push_back(centre_m.y);
    z_m_.push_back(centre_m.z);
    radius_m_.push_back(glm::length(box.high_m - centre_m));
  }
}

void ChangedParts::clear() {
  boxes_.clear();
  for (auto* column : {&x_m_, &y_m_, &z_m_, &radius_m_}) column->clear();
}

// A cheap test of the spheres finds the few boxes to test.
bool ChangedParts::pass_near(const Vec3f& from_m, const Vec3f& to_m, float margin_m) const {
  const Vec3f along_m = to_m - from_m;
  const float per_length2 = 1 / std::max(glm::dot(along_m, along_m), 1e-12f);
  const float reach_m = 1.7321f * margin_m;  // of the corners of an enlarged box
  for (std::size_t first = 0; first < boxes_.size(); first += kBlock) {
    const std::size_t count = std::min(kBlock, boxes_.size() - first);
    unsigned char is_hit[kBlock];
    unsigned char any = 0;
    for (std::size_t i = 0; i < count; ++i) {
      const float x = x_m_[first + i] - from_m.x, y = y_m_[first + i] - from_m.y,
                  z = z_m_[first + i] - from_m.z;
      const float t = (x * along_m.x + y * along_m.y + z * along_m.z) * per_length2;
      const float nearest = std::min(std::max(t, 0.0f), 1.0f);
      const float dx = x - nearest * along_m.x, dy = y - nearest * along_m.y,
                  dz = z - nearest * along_m.z;
      const float limit_m = radius_m_[first + i] + reach_m;
      is_hit[i] = dx * dx + dy * dy + dz * dz <= limit_m * limit_m;
      any |= is_hit[i];
    }
    if (any == 0) continue;
    for (std::size_t i = 0; i < count; ++i)
      if (is_hit[i] != 0 && meets(boxes_[first + i], from_m, to_m, margin_m)) return true;
  }
  return false;
}

bool ChangedParts::are_reached(const Vec3f& from_m, const Vec3f& to_m, float length_m) const {
  return std::any_of(boxes_.begin(), boxes_.end(), [&](const PartBounds& box) {
    return distance_m(box, from_m) + distance_m(box, to_m) <= length_m;
  });
}

}  // namespace clamor
