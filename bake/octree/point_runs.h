// point_runs.h: points in Morton order, for finding the neighbours of all of them.
//
// Points are sorted along a Morton curve (morton_order.h) and cut into runs of 16, which are
// compact. Over the bounding boxes of the runs lies a tree in which each box holds the eight below
// it.
//
// Memory: 34 bytes per point, in memory or in a file. Threads: the caller's team sorts;
// all else is const.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <vector>

#include "bake/octree/scratch_list.h"
#include "common/result.h"
#include "common/vec.h"

namespace clamor {

// A place with a power, and the index by which its owner knows it.
struct PowerPoint {
  std::uint64_t morton_code = 0;
  Vec3f position_m{};
  std::uint32_t index = 0;
  double power = 0;
};

class PointRuns {
 public:
  static constexpr std::size_t kRun = 16, kFan = 8;

  // Eight bounding boxes, of runs or of such eight; those without points are at infinity.
  struct Boxes {
    static constexpr float kFar = std::numeric_limits<float>::infinity();
    using Eight = std::array<float, kFan>;
    static constexpr Eight kAllFar = {kFar, kFar, kFar, kFar, kFar, kFar, kFar, kFar};
    static constexpr Eight kAllBelow = {-kFar, -kFar, -kFar, -kFar, -kFar, -kFar, -kFar, -kFar};
    std::array<Eight, 3> low{kAllFar, kAllFar, kAllFar}, high{kAllBelow, kAllBelow, kAllBelow};
  };

  // Sorts the points; those of a list in a file, with `memory_bytes` of memory.
  static Result<PointRuns> make(ScratchList<PowerPoint> points, std::uint64_t memory_bytes);

  std::size_t size() const { return count_; }
  std::size_t runs() const { return (count_ + kRun - 1) / kRun; }

  // Values of point i in Morton order, followed by those of the points to the end of its run. After
  // the last point, the last run has points at infinity.
  const float* position_m(std::size_t axis, std::size_t i) const {
    return &runs_[i / kRun].position_m[axis][i % kRun];
  }
  const double* power(std::size_t i) const { return &runs_[i / kRun].power[i % kRun]; }
  std::uint32_t index(std::size_t i) const { return runs_[i / kRun].index[i % kRun]; }

  // Levels of the tree: the first holds the boxes of the runs, eight at a time, the last has one
  // element.
  std::span<const std::span<Boxes>> levels() const { return levels_; }

  // Lets the points of a list in a file leave the memory until they are used again.
  void release();

 private:
  struct Run {
    std::array<std::array<float, kRun>, 3> position_m;
    std::array<double, kRun> power;
    std::array<std::uint32_t, kRun> index;
  };

  explicit PointRuns(ScratchList<PowerPoint> points)
      : count_(points.size()), points_(std::move(points)), boxes_(points_.beside()) {}
  void sort(std::size_t first, std::size_t last, int bit, std::uint64_t memory_bytes);
  Result<void> make_runs();
  void enclose();

  std::size_t count_;
  ScratchList<PowerPoint> points_;  // later with runs in place of points
  ScratchList<Boxes> boxes_;
  const Run* runs_ = nullptr;
  std::vector<std::span<Boxes>> levels_;  // of boxes_
};

}  // namespace clamor
