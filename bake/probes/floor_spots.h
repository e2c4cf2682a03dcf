// floor_spots.h: the walkable floor of a level, sampled once per column of the air lattice.
//
// A surface is walkable if its normal is within 45 degrees of the vertical, a reached air cell lies
// above it and there is headroom. Spots whose heights differ by no more than a stair form a patch;
// patches smaller than a table are left out.
#pragma once

#include <vector>

#include "bake/probes/air_lattice.h"
#include "bake/trace/scene.h"
#include "common/vec.h"

namespace clamor {

struct FloorSpot {
  LatticeCell cell{};    // of the air just above the floor
  Vec3 ear_m{};          // at ear height: 1.5 m above the floor, or half of the free height if less
  double floor_m = 0;    // height of the floor
  bool is_open = false;  // nothing is above
  bool is_roof = false;  // of a patch under the open sky with another floor below it
};

// In the order of the columns, from bottom to top.
std::vector<FloorSpot> find_floor(const Scene& scene, const AirLattice& lattice);

}  // namespace clamor
