// direct_sound.h: how much of a direct sound arrives, and from where.
//
// Emitters and moving sources are heard one by one, so their diffraction is that of the level's
// edges (edge_diffraction.h): first and second order, with phases. Around an edge, sound arrives
// from the edge, later than along the straight line.
//
// Where too many edges are between source and listener (a crowd of columns, foliage), the
// unoccluded fraction of the Fresnel zone (fresnel_visibility.h) takes over, band by band: the
// higher the band, the fewer edges matter. It also bounds the power from below where no path over
// two edges leads to the listener.
//
// Threads: any.   Cost: nothing where the whole zone is free; up to 1000 rays and 1 ms where an
// edge is near the path.
#pragma once

#include <cstdint>
#include <optional>

#include "common/bands.h"
#include "common/vec.h"
#include "runtime/occlusion/diffraction_paths.h"
#include "runtime/occlusion/fresnel_visibility.h"
#include "runtime/occlusion/occlusion_geometry.h"

namespace clamor {

struct DirectSound {
  Tones pressure{};    // relative to a free field: the straight path and all edges
  Bands visibility{};  // share of the power in a free field; above 1 where an edge adds to it
  bool is_over_edges = false;      // whether any sound is heard over an edge
  std::optional<BentPath> bent{};  // where the straight line is blocked
};

// Sound that arrives along a line, from the estimate of fresnel_visibility(). Adds the rays cast to
// `rays`.
DirectSound direct_sound(const OcclusionGeometry& geometry, const LineOfSight& line,
                         const Bands& zone, bool line_is_free, std::uint64_t& rays);

}  // namespace clamor
