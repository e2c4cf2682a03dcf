#include "bake/probes/probe_view.h"

#include <algorithm>
#include <cstdint>

#include "bake/probes/air_lattice.h"
#include "common/sphere.h"

namespace clamor {

namespace {

constexpr double kEnd = 0.9;  // of the way to the surface

const std::array<Vec3, ProbeView::kRays>& view_directions() {
  static const auto directions = [] {
    std::array<Vec3, ProbeView::kRays> all;
    for (std::uint32_t i = 0; i < ProbeView::kRays; ++i)
      all[i] = spread_direction(i, ProbeView::kRays);
    return all;
  }();
  return directions;
}

double hidden_share(const Scene& scene, const Vec3& from_m, const ProbeView& view,
                    std::size_t stride) {
  std::size_t hidden = 0, count = 0;
  for (std::size_t i = 0; i < ProbeView::kRays; i += stride, ++count)
    hidden += !is_free(scene, from_m, view.ends_m[i]);
  return static_cast<double>(hidden) / static_cast<double>(count);
}

}  // namespace

ProbeView view_from(const Scene& scene, const Vec3& place_m, double reach_m) {
  ProbeView view;
  view.clearance_m = reach_m;
  double sum_m = 0;
  for (std::size_t i = 0; i < ProbeView::kRays; ++i) {
    const Vec3& direction = view_directions()[i];
    const auto hit = scene.intersect(place_m, direction);
    const double distance_m = hit ? std::min(hit->distance_m, reach_m) : reach_m;
    view.ends_m[i] = place_m + kEnd * distance_m * direction;
    view.clearance_m = std::min(view.clearance_m, distance_m);
    view.escaped += !hit;
    view.behind += hit && hit->from_behind;
    sum_m += distance_m;
  }
  view.mean_free_path_m = 4.0 / 3 * sum_m / ProbeView::kRays;
  return view;
}

double view_change(const Scene& scene, const Vec3& a_m, const ProbeView& a, const Vec3& b_m,
                   const ProbeView& b, std::size_t stride) {
  return std::max(hidden_share(scene, a_m, b, stride), hidden_share(scene, b_m, a, stride));
}

}  // namespace clamor
