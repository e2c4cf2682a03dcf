// probe_placement.h: places probes where sources may be.
//
// A probe is a place where the bake traces an omnidirectional emitter of unit power. At run time
// the reflections of a moving source are copies of the secondary sources of the probes around it,
// so probes lie where sources go:
//
//   reach     a flood fill of the air from emitters and hand-placed probes (reachable_air.h)
//   floors    candidates at ear height above walkable floor, sparser ones in the air above
//   thinning  in a fixed order: both sides of openings, a square lattice, gaps (probe_thinning.h)
//
// The placement depends on the surfaces, the reached rooms, the hand-placed probes and the options.
// Everything is decided in double precision, in a fixed order and on one thread.
//
// Threads: one.   Cost: below a second for 66 000 triangles and 600 probes.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "bake/trace/scene.h"
#include "common/result.h"
#include "common/vec.h"

namespace clamor {

struct Level;

struct ProbeOptions {
  enum class Placement {
    kNone,       // hand-placed probes only
    kAutomatic,  // a spacing that suits the rooms, and at most `max_automatic` probes
    kSpacing     // `spacing_m`
  };

  Placement placement = Placement::kAutomatic;
  double spacing_m = 0;
  std::size_t max_automatic = 450;  // which take 20 MB
};

struct ProbePlacement {
  static constexpr std::size_t kMaxProbes = 20'000;

  std::vector<Vec3> positions_m;  // hand-placed ones first, as in the level
  std::size_t hand_placed = 0;
  double spacing_m = 0;               // in large rooms; 0 if none were placed automatically
  double floor_m2 = 0;                // walkable floor that sources can reach
  std::vector<std::string> warnings;  // sentences without full stop
};

// The scene must be built from the level's mesh. A level without triangles has no probes. A spacing
// that is not above zero, or that would take more than kMaxProbes, is an Error.
Result<ProbePlacement> place_probes(const Scene& scene, const Level& level,
                                    const ProbeOptions& options);

}  // namespace clamor
