// probe_view.h: what is seen from a place, and how much of it another place sees, too.
//
// Two places whose views agree reflect a source alike, so one probe serves both. Views change at
// doorways, arches and corners.
//
// Threads: all functions may be called concurrently.
#pragma once

#include <array>
#include <cstddef>

#include "bake/trace/scene.h"
#include "common/vec.h"

namespace clamor {

struct ProbeView {
  static constexpr std::size_t kRays = 24;

  std::array<Vec3, kRays> ends_m{};  // just in front of the surfaces seen
  double clearance_m = 0;            // to the nearest of them
  double mean_free_path_m = 0;       // 4/3 of the mean distance, as in the middle of a sphere
  std::size_t escaped = 0;           // rays that meet nothing
  std::size_t behind = 0;            // rays that meet the back of a surface
};

// Rays that meet nothing count as `reach_m` long.
ProbeView view_from(const Scene& scene, const Vec3& place_m, double reach_m);

// The share of the ends of one view that the other place does not see, whichever way it is larger:
// 0 within a convex room, near 1 on the two sides of a door. Looks at every `stride`-th ray.
double view_change(const Scene& scene, const Vec3& a_m, const ProbeView& a, const Vec3& b_m,
                   const ProbeView& b, std::size_t stride = 2);

}  // namespace clamor
