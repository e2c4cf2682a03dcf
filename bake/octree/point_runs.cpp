#include "bake/octree/point_runs.h"

#include <algorithm>
#include <array>

#include "common/bounds.h"
#include "common/morton_order.h"
#include "common/thread_team.h"

namespace clamor {

namespace {

struct MortonKey {
  std::uint64_t code;
  std::uint32_t point;
};

PowerPoint power_point(const PowerPoint& point, std::uint32_t /*place*/) { return point; }

template <class Point>
std::vector<MortonKey> in_morton_order(std::span<const Point> points) {
  constexpr double kSteps = (1 << 21) - 1;
  const Boundsf bounds = bounds_of(points, &Point::position_m);
  const Vec3 low_m(bounds.low_m), extent_m = Vec3(bounds.high_m) - low_m;
  const double largest_m = std::max({extent_m.x, extent_m.y, extent_m.z});
  const double steps_per_m = largest_m > 0 ? kSteps / largest_m : 0;
  std::vector<MortonKey> keys(points.size());
  team_for(0, points.size(), 4096, [&](std::size_t i) {
    const Vec3 steps = (Vec3(points[i].position_m) - low_m) * steps_per_m;
    keys[i] = {morton_code(steps), static_cast<std::uint32_t>(i)};
  });
  team_sort(keys.begin(), keys.end(), [](const MortonKey& a, const MortonKey& b) {
    return a.code != b.code ? a.code < b.code : a.point < b.point;
  });
  return keys;
}

// Squared distances of a place from the boxes, in loops that compilers vectorise.
PointRuns::Boxes::Eight distances_squared(const PointRuns::Boxes& boxes, const Vec3f& place_m) {
  PointRuns::Boxes::Eight squared{};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const float at = place_m[static_cast<int>(axis)];
    const auto &low = boxes.low[axis], &high = boxes.high[axis];
    for (std::size_t i = 0; i < PointRuns::kFan; ++i) {
      const float beyond = std::max(std::max(low[i] - at, at - high[i]), 0.0f);
      squared[i] += beyond * beyond;
    }
  }
  return squared;
}

}  // namespace

PowerPoint power_point(const Source& source, std::uint32_t index) {
  return {source.position_m, index, sum_of(source.power)};
}

PointRuns::PointRuns(std::span<const PowerPoint> points) : count_(points.size()) { sort(points); }
PointRuns::PointRuns(std::span<const Source> sources) : count_(sources.size()) { sort(sources); }

template <class Point>
void PointRuns::sort(std::span<const Point> points) {
  const auto keys = in_morton_order(points);
  const std::size_t padded = (count_ + kRun - 1) / kRun * kRun;
  for (auto& column : position_m_) column.resize(padded, Boxes::kFar);
  power_.resize(padded);
  index_.resize(count_);
  team_for(0, count_, 4096, [&](std::size_t i) {
    const PowerPoint point = power_point(points[keys[i].point], keys[i].point);
    for (std::size_t axis = 0; axis < 3; ++axis)
      position_m_[axis][i] = point.position_m[static_cast<int>(axis)];
    power_[i] = point.power;
    index_[i] = point.index;
  });
  enclose();
}

void PointRuns::enclose() {
  levels_.emplace_back((runs() + kFan - 1) / kFan);
  for (std::size_t i = 0; i < count_; ++i) {
    const std::size_t run = i / kRun;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      float& low = levels_[0][run / kFan].low[axis][run % kFan];
      float& high = levels_[0][run / kFan].high[axis][run % kFan];
      low = std::min(low, position_m_[axis][i]);
      high = std::max(high, position_m_[axis][i]);
    }
  }
  while (levels_.back().size() > 1) {
    const auto& below = levels_.back();
    std::vector<Boxes> above((below.size() + kFan - 1) / kFan);
    for (std::size_t i = 0; i < below.size(); ++i)
      for (std::size_t axis = 0; axis < 3; ++axis) {
        const auto& low = below[i].low[axis];
        const auto& high = below[i].high[axis];
        above[i / kFan].low[axis][i % kFan] = *std::min_element(low.begin(), low.end());
        above[i / kFan].high[axis][i % kFan] = *std::max_element(high.begin(), high.end());
      }
    levels_.push_back(std::move(above));
  }
}

void PointRuns::find(const Vec3f& place_m, NearestNeighbours& neighbours) const {
  if (count_ == 0) return;
  const auto visit_run = [&](std::size_t first) {
    std::array<float, kRun> squared;
    for (std::size_t i = 0; i < kRun; ++i) {
      const float x = place_m.x - position_m_[0][first + i],
                  y = place_m.y - position_m_[1][first + i],
                  z = place_m.z - position_m_[2][first + i];
      squared[i] = x * x + y * y + z * z;
    }
    for (std::size_t i = 0; i < std::min(kRun, count_ - first); ++i)
      if (squared[i] <= loosened(neighbours.farthest_squared()))
        neighbours.add(squared[i], power_[first + i]);
  };
  const auto visit = [&](const auto& self, std::size_t level, std::size_t element) -> void {
    const Boxes::Eight squared = distances_squared(levels_[level][element], place_m);
    for (std::size_t i = 0; i < kFan; ++i) {
      if (!(squared[i] <= loosened(neighbours.farthest_squared()))) continue;
      const std::size_t below = element * kFan + i;
      if (level > 0)
        self(self, level - 1, below);
      else if (below < runs())
        visit_run(below * kRun);
    }
  };
  visit(visit, levels_.size() - 1, 0);
}

}  // namespace clamor
