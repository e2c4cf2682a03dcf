// neighbour_scratch.h: working memory of the search for neighbours (neighbour_kernel.h).
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

#include "bake/octree/nearest_neighbours.h"
#include "bake/octree/point_runs.h"

namespace clamor {

struct NeighbourScratch {
  // There are at most so many candidates, 64 that are added at once and the lanes of a vector.
  static constexpr std::size_t kMost = 256, kRoom = kMost + 64 + PointRuns::kFan;

  // The runs that the bounds of the current run reach, and their boxes.
  std::vector<std::uint32_t> runs;
  std::array<std::vector<float>, 3> low, high;
  std::vector<std::pair<std::uint32_t, std::uint32_t>> stack;  // level and element

  // The runs that lie within the bound of the current point.
  std::vector<std::uint32_t> near_runs;

  // The points within this bound, and the nearest of them.
  struct Points {
    std::array<float, kRoom> squared;  // distances, m^2
    std::array<std::uint32_t, kRoom> point;
  };
  Points candidates, nearest;

  // The powers of the neighbours of each point of the run.
  std::array<std::array<double, PointRuns::kRun>, kNeighbours> power;
};

}  // namespace clamor
