// point_runs.h: points in Morton order, for finding the neighbours of all of them.
//
// Points are sorted along a Morton curve (morton_order.h) and cut into runs of 16, which are
// compact. Over the bounding boxes of the runs lies a tree in which each box holds the eight below
// it.
//
// Memory: 26 bytes per point, and 16 more while they are sorted. Threads: the caller's
// team sort; all else is const.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <vector>

#include "bake/octree/nearest_neighbours.h"
#include "common/vec.h"
#include "formats/bake_file/source.h"

namespace clamor {

// A place with a power, and the index by which its owner knows it.
struct PowerPoint {
  Vec3f position_m;
  std::uint32_t index = 0;
  double power = 0;
};

PowerPoint power_point(const Source& source, std::uint32_t index);

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

  explicit PointRuns(std::span<const PowerPoint> points);
  // The index of a source is its place in the list.
  explicit PointRuns(std::span<const Source> sources);

  std::size_t size() const { return count_; }
  std::size_t runs() const { return position_m_[0].size() / kRun; }

  // Columns in Morton order. After the last point, the last run has points at infinity.
  const float* position_m(std::size_t axis) const { return position_m_[axis].data(); }
  const double* power() const { return power_.data(); }
  std::span<const std::uint32_t> index() const { return index_; }

  PowerPoint point(std::size_t i) const {
    return {{position_m_[0][i], position_m_[1][i], position_m_[2][i]}, index_[i], power_[i]};
  }

  // Levels of the tree: the first holds the boxes of the runs, eight at a time, the last has one
  // element.
  std::span<const std::vector<Boxes>> levels() const { return levels_; }

  // Adds the points round a place to its neighbours.
  void find(const Vec3f& place_m, NearestNeighbours& neighbours) const;

 private:
  template <class Point>
  void sort(std::span<const Point> points);
  void enclose();

  std::size_t count_;
  std::array<std::vector<float>, 3> position_m_;
  std::vector<double> power_;
  std::vector<std::uint32_t> index_;
  std::vector<std::vector<Boxes>> levels_;
};

}  // namespace clamor
