#include "runtime/occlusion/visibility_estimate.h"

#include "runtime/occlusion/direct_sound.h"
#include "runtime/occlusion/image_path.h"

namespace clamor {

namespace {

void set_from(const DirectSound& sound, VisibilityEstimate& estimate) {
  estimate.diffracted = sound.visibility;
  estimate.is_over_edges = sound.is_over_edges;
  estimate.bent = sound.bent;
}

}  // namespace

VisibilityEstimate estimate_visibility(const OcclusionGeometry& geometry, const Source& source,
                                       const LineOfSight& line, int paths_per_ring,
                                       bool is_over_edges) {
  VisibilityEstimate estimate;
  if (source.is_image) {
    estimate.line_is_free = true;
    set_from(image_sound(geometry, source, line, estimate.rays), estimate);
    return estimate;
  }
  estimate.diffracted =
      fresnel_visibility(geometry, line, paths_per_ring, estimate.rays, &estimate.line_is_free);
  if (is_over_edges) add_edges(geometry, line, estimate);
  return estimate;
}

void add_edges(const OcclusionGeometry& geometry, const LineOfSight& line,
               VisibilityEstimate& estimate) {
  set_from(direct_sound(geometry, line, estimate.diffracted, estimate.line_is_free, estimate.rays),
           estimate);
}

}  // namespace clamor
