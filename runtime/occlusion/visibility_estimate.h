// visibility_estimate.h: the visibility of one source from one place, by the model for its kind.
//
// Reflections take the unoccluded fraction of their Fresnel zones (fresnel_visibility.h). Direct
// sounds add the edges near their zone (direct_sound.h), and images the mirrors of their path
// (image_path.h).
//
// Threads: any.
#pragma once

#include <cstdint>
#include <optional>

#include "common/bands.h"
#include "formats/bake_file/source.h"
#include "runtime/occlusion/diffraction_paths.h"
#include "runtime/occlusion/fresnel_visibility.h"
#include "runtime/occlusion/occlusion_geometry.h"

namespace clamor {

struct VisibilityEstimate {
  Bands diffracted{};              // share of the power that arrives beside the surfaces
  bool line_is_free = false;       // the straight line; true for an image
  bool is_over_edges = false;      // whether any of it is heard over an edge
  std::optional<BentPath> bent{};  // where the straight path is blocked
  std::uint64_t rays = 0;          // cast for this estimate
};

// `line` begins at the origin of the source's rays, or at the image. A direct sound takes the edges
// into account if `is_over_edges`.
VisibilityEstimate estimate_visibility(const OcclusionGeometry& geometry, const Source& source,
                                       const LineOfSight& line, int paths_per_ring,
                                       bool is_over_edges);

// Adds the edges to the estimate of a direct sound's zone, and rows of seats (seat_rows.h).
void add_edges(const OcclusionGeometry& geometry, const LineOfSight& line,
               VisibilityEstimate& estimate);

}  // namespace clamor
