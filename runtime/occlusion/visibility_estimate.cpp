#include "runtime/occlusion/visibility_estimate.h"

#include "runtime/occlusion/direct_sound.h"
#include "runtime/occlusion/image_path.h"
#include "runtime/occlusion/seat_rows.h"

namespace clamor {

namespace {

void set_from(const DirectSound& sound, VisibilityEstimate& estimate) {
  estimate.diffracted = sound.visibility;
  estimate.is_over_edges = sound.is_over_edges;
  estimate.bent = sound.bent;
}

void add_rows(const OcclusionGeometry& geometry, const PathEnd& from, const LineOfSight& line,
              VisibilityEstimate& estimate) {
  if (!geometry.has_rows()) return;
  const Bands factor =
      power_over_rows(geometry, from, Vec3(line.to_m), line.speed_of_sound_mps, estimate.rays);
  for (std::size_t b = 0; b < kBandCount; ++b) estimate.diffracted[b] *= factor[b];
}

}  // namespace

VisibilityEstimate estimate_visibility(const OcclusionGeometry& geometry, const Source& source,
                                       const LineOfSight& line, int paths_per_ring,
                                       bool is_over_edges) {
  VisibilityEstimate estimate;
  if (source.is_image) {
    estimate.line_is_free = true;
    set_from(image_sound(geometry, source, line, estimate.rays), estimate);
    add_rows(geometry, PathEnd(Vec3(line.from_m), Vec3(source.original_m), source.is_in_part), line,
             estimate);
    return estimate;
  }
  estimate.diffracted = fresnel_visibility(geometry, is_over_edges ? either_way(line) : line,
                                           paths_per_ring, estimate.rays, &estimate.line_is_free);
  if (is_over_edges) add_edges(geometry, line, estimate);
  return estimate;
}

void add_edges(const OcclusionGeometry& geometry, const LineOfSight& line,
               VisibilityEstimate& estimate) {
  set_from(direct_sound(geometry, line, estimate.diffracted, estimate.line_is_free, estimate.rays),
           estimate);
  if (estimate.line_is_free) add_rows(geometry, Vec3(line.from_m), line, estimate);
}

}  // namespace clamor
