// path_record.h: the materials that traced paths have met, for re-weighing (bake/path_cache.h).
//
// Paths form trees, since copies of a photon (weight_window.h) share the reflections before they
// were split. A node is one hit of a surface. Powers that leave no deposit are recorded, too, so
// that the statistics of a run can be re-weighed.
#pragma once

#include <cstdint>
#include <vector>

#include "common/bands.h"

namespace clamor {

struct PathNode {
  static constexpr std::uint32_t kNone = 0xffffffff;  // before the first hit

  std::uint32_t before = kNone;  // index of the hit before
  std::uint32_t material = 0;
};

// Power that is counted in a tally of TraceTally.
struct PathTally {
  enum class Kind : std::uint8_t { kEscaped, kUnfinished, kOfImage };
  Kind kind{};
  std::uint16_t run = 0;                 // index in the call of the tracer, later in TracedRuns
  std::uint32_t node = PathNode::kNone;  // the surface there has not absorbed yet if kUnfinished
  Bands power{};
};

struct PathRecord {
  std::vector<PathNode> nodes;          // parents precede children
  std::vector<std::uint32_t> deposits;  // node of each deposit
  std::vector<PathTally> tallies;
};

}  // namespace clamor
