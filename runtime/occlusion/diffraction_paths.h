// diffraction_paths.h: paths around edges, of first and second order, from a source to a listener.
//
// Threads: any.   Cost: 20 rays and 10 us per edge, 3 rays and 20 us per pair.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "common/vec.h"
#include "runtime/occlusion/diffracting_edges.h"
#include "runtime/occlusion/edge_diffraction.h"
#include "runtime/occlusion/fresnel_visibility.h"
#include "runtime/occlusion/mirror_path.h"
#include "runtime/occlusion/occlusion_geometry.h"

namespace clamor {

// How sound reaches the listener around edges: the place that it seems to come from, as far away as
// its way around them is long, and the unit direction in which it leaves the source.
struct BentPath {
  Vec3f heard_at_m{}, leaves{};
};

// The mean of a path and the straight line; `share` is that of the path.
BentPath blend(const LineOfSight& line, const BentPath& path, double share);

// The mean over all ways, the louder ones by far the most; nothing if they cancel out.
std::optional<BentPath> mean_path(const LineOfSight& line, std::span<const EdgeSound> sounds);

class DiffractionPaths {
 public:
  // `found` are the edges between both ends, in the order of detours. With `are_paired`, two edges
  // in a row count as well. Adds the rays cast to `rays`.
  DiffractionPaths(const OcclusionGeometry& geometry, const PathEnd& from, const PathEnd& to,
                   double speed_of_sound_mps, std::vector<EdgeBetween> found, bool are_paired,
                   std::uint64_t& rays);

  const std::vector<EdgeSound>& sounds() const { return sounds_; }

  // From 0 where few edges matter in a band to 1 where so many do that the zone knows better.
  float clutter(std::size_t band) const;

 private:
  void add(EdgeSound sound);
  void add_single_edges();
  void add_pairs();

  const OcclusionGeometry& geometry_;
  PathEnd from_, to_;
  double speed_of_sound_mps_;
  std::uint64_t& rays_;
  std::vector<EdgeBetween> found_;
  std::vector<EdgeInAir> edges_;
  std::vector<double> in_sight_;  // detours of the edges that an end sees
  std::vector<std::size_t> seen_by_source_, seen_by_listener_;
  std::vector<EdgeSound> sounds_;
  bool heard_ = false;
  double nearest_heard_m_ = 0;
};

}  // namespace clamor
