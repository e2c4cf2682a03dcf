// changed_parts.h: where movable parts have appeared, moved or vanished since the last keyframe,
// and which paths these changes may concern.
//
// Threads: the sampler's alone.   Cost: 100 ns for a path beside 100 doors that have moved.
#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "common/vec.h"
#include "runtime/occlusion/part_scene.h"

namespace clamor {

class ChangedParts {
 public:
  void add(std::span<const PartBounds> bounds);
  void clear();
  bool empty() const { return boxes_.empty(); }

  // Returns whether the segment passes any of the bounds within about `margin_m`.
  bool pass_near(const Vec3f& from_m, const Vec3f& to_m, float margin_m) const;

  // Returns whether any path from one point to the other that is no longer than `length_m` can meet
  // any of the bounds.
  bool are_reached(const Vec3f& from_m, const Vec3f& to_m, float length_m) const;

 private:
  std::vector<PartBounds> boxes_;
  // Spheres around the boxes, as columns.
  std::vector<float> x_m_, y_m_, z_m_, radius_m_;
};

}  // namespace clamor
