// reachable_air.h: the air of a level that sources can reach.
//
// Emitters and hand-placed probes show where sources are; a level without them is reached from the
// points that its surfaces enclose and, unless it is closed, from the open sky. Seeds inside solids
// and outside closed levels count for nothing.
//
// Threads: one.
#pragma once

#include <vector>

#include "bake/probes/air_lattice.h"
#include "bake/report/audibility.h"
#include "bake/report/space_explorer.h"
#include "bake/trace/scene.h"
#include "common/vec.h"
#include "formats/level/emitter.h"

namespace clamor {

struct Level;

class ReachableAir {
 public:
  // Scene and level must outlive the object; the level must have triangles. Above an open level the
  // air reaches up to `sky_m` higher than its surfaces, 10 m at most.
  ReachableAir(const Scene& scene, const Level& level, double sky_m);

  const AirLattice& lattice() const { return lattice_; }
  bool is_closed() const { return space_.is_closed(); }
  double extent_m() const { return space_.extent_m(); }
  double high_m() const { return bounds_.high_m.y; }  // of the surfaces

 private:
  void flood_from(const std::vector<Vec3>& seeds_m);
  void flood_from_sky();

  const Scene& scene_;
  const Level& level_;
  SpaceExplorer space_;
  Bounds bounds_;
  AirLattice lattice_;
};

// Returns an emitter at the place, which Audibility judges.
Emitter emitter_at(const Vec3& place_m);

}  // namespace clamor
