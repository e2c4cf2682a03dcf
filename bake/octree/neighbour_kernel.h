// neighbour_kernel.h: patch radii of points in Morton order from their nearest neighbours,
// vectorised.
//
// A search starts with an upper bound of the distance, from the points beside it in Morton order
// and from the search before it. The boxes within the bounds of all points of a run are found at
// once. Of the points that remain, about 30, the nearest are those that fewer than 16 others are
// nearer than.
//
// Results have the same bits on every instruction set, and those of NearestNeighbours.
#pragma once

#include <cstddef>
#include <memory>
#include <span>

#include "bake/octree/point_runs.h"

namespace clamor {

// Working memory of one thread.
struct NeighbourScratch;
struct DeleteNeighbourScratch {
  void operator()(NeighbourScratch* scratch) const;
};
std::unique_ptr<NeighbourScratch, DeleteNeighbourScratch> make_neighbour_scratch();

struct FoundRadius {
  float farthest_squared = 0;  // squared distance of the farthest neighbour, m^2
  float radius_m = 0;
};

// Finds the radii of the points of a run, at most PointRuns::kRun. `before` is a point whose
// farthest neighbour is known, which should be near, or PointRuns::size(). There are at least
// kNeighbours points.
void find_radii_of_run(const PointRuns& points, std::size_t run, std::size_t before,
                       float before_squared, NeighbourScratch& scratch,
                       std::span<FoundRadius, PointRuns::kRun> found);

}  // namespace clamor
