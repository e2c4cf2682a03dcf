#include "bake/trace/portal_crossings.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "common/bounds.h"

namespace clamor {

namespace {

// Half the extent of the rectangle's box.
Vec3 half_box_m(const Portal& portal) {
  return glm::abs(portal.half_u_m) + glm::abs(portal.half_v_m);
}

}  // namespace

PortalCrossings::PortalCrossings(std::span<const Portal> portals, double offset_m)
    : offset_m_(static_cast<float>(offset_m)) {
  std::vector<std::uint16_t> indices(portals.size());
  std::iota(indices.begin(), indices.end(), std::uint16_t{0});
  if (!indices.empty()) divide(portals, indices);
}

// Halves the portals along the longest axis of their centres' box, down to groups.
void PortalCrossings::divide(std::span<const Portal> portals, std::span<std::uint16_t> indices) {
  const Bounds centres = bounds_of(indices, [&](std::uint16_t i) { return portals[i].centre_m; });
  if (indices.size() > kGroup) {
    const Vec3 extent_m = centres.high_m - centres.low_m;
    int axis = 0;
    for (int other : {1, 2})
      if (extent_m[other] > extent_m[axis]) axis = other;
    std::sort(indices.begin(), indices.end(), [&](std::uint16_t a, std::uint16_t b) {
      const double at_a = portals[a].centre_m[axis], at_b = portals[b].centre_m[axis];
      return at_a != at_b ? at_a < at_b : a < b;
    });
    const std::size_t half = (indices.size() / 2 + kGroup - 1) / kGroup * kGroup;
    divide(portals, indices.first(half));
    divide(portals, indices.subspan(half));
    return;
  }
  add_group(portals, indices);
}

void PortalCrossings::add_group(std::span<const Portal> portals,
                                std::span<const std::uint16_t> indices) {
  Group& group = groups_.emplace_back();
  Vec3f low_m(1e30f), high_m(-1e30f);
  for (const std::uint16_t i : indices) {
    const Portal& portal = portals[i];
    const std::size_t lane = group.count++;
    group.portal[lane] = i;
    const Vec3 normal = normal_of(portal);
    const auto put = [&](Function& function, const Vec3& gradient) {
      for (std::size_t axis = 0; axis < 3; ++axis)
        function.factor[axis][lane] = static_cast<float>(gradient[static_cast<int>(axis)]);
      function.constant[lane] = static_cast<float>(-dot(gradient, portal.centre_m));
    };
    // The gradient of `a` is perpendicular to half_v and has the product 1 with half_u.
    const Vec3 across_u = cross(portal.half_v_m, normal), across_v = cross(normal, portal.half_u_m);
    put(group.plane, normal);
    put(group.side_u, across_u / dot(across_u, portal.half_u_m));
    put(group.side_v, across_v / dot(across_v, portal.half_v_m));
    constexpr float kMargin_m = 1e-3f;
    low_m = glm::min(low_m, Vec3f(portal.centre_m - half_box_m(portal)) - kMargin_m);
    high_m = glm::max(high_m, Vec3f(portal.centre_m + half_box_m(portal)) + kMargin_m);
  }
  add_box(low_m, high_m);
}

// Adds the box of the last group.
void PortalCrossings::add_box(const Vec3f& low_m, const Vec3f& high_m) {
  const std::size_t lane = (groups_.size() - 1) % kGroup;
  if (lane == 0) {
    Boxes& empty = boxes_.emplace_back();
    for (std::size_t axis = 0; axis < 3; ++axis) {
      empty.low_m[axis].fill(1e30f);
      empty.high_m[axis].fill(-1e30f);
    }
  }
  for (std::size_t axis = 0; axis < 3; ++axis) {
    boxes_.back().low_m[axis][lane] = low_m[static_cast<int>(axis)];
    boxes_.back().high_m[axis][lane] = high_m[static_cast<int>(axis)];
  }
}

// With the plane's function d and a side's function s at both ends of the leg, the leg passes the
// plane if the signs of d_0 and d_1 differ, at s = (s_1 d_0 - s_0 d_1) / (d_0 - d_1).
void PortalCrossings::add_leg(const Group& group, const Vec3f& from_m, const Vec3f& to_m,
                              PortalSet& set) {
  const auto value = [](const Function& f, const Vec3f& p, std::size_t lane) {
    return f.factor[0][lane] * p.x + f.factor[1][lane] * p.y + f.factor[2][lane] * p.z +
           f.constant[lane];
  };
  std::array<std::int32_t, kGroup> passes;
  std::int32_t any = 0;
  for (std::size_t lane = 0; lane < kGroup; ++lane) {
    const float d0 = value(group.plane, from_m, lane), d1 = value(group.plane, to_m, lane);
    const float u0 = value(group.side_u, from_m, lane), u1 = value(group.side_u, to_m, lane);
    const float v0 = value(group.side_v, from_m, lane), v1 = value(group.side_v, to_m, lane);
    const float span = std::abs(d0 - d1);
    passes[lane] = static_cast<std::int32_t>((d0 < 0) != (d1 < 0)) &
                   static_cast<std::int32_t>(std::abs(u1 * d0 - u0 * d1) <= span) &
                   static_cast<std::int32_t>(std::abs(v1 * d0 - v0 * d1) <= span);
    any |= passes[lane];
  }
  if (any == 0) return;
  for (std::size_t lane = 0; lane < group.count; ++lane)
    if (passes[lane] != 0) set.add(group.portal[lane]);
}

void PortalCrossings::add(std::span<KernelPhoton> photons, std::span<const std::uint16_t> alive,
                          std::span<const Ray> rays, std::span<const SurfaceHit> hits) const {
  for (std::size_t i = 0; i < alive.size(); ++i) {
    if (hits[i].material == SurfaceHit::kNone) continue;
    const float length_m = hits[i].distance_m - offset_m_;
    if (!(length_m > 0)) continue;
    const Vec3f from_m = rays[i].origin_m, to_m = from_m + rays[i].direction * length_m;
    const Vec3f low_m = glm::min(from_m, to_m), high_m = glm::max(from_m, to_m);
    for (std::size_t b = 0; b < boxes_.size(); ++b) {
      const Boxes& boxes = boxes_[b];
      std::array<std::int32_t, kGroup> meets;
      std::int32_t any = 0;
      for (std::size_t lane = 0; lane < kGroup; ++lane) {
        meets[lane] = 1;
        for (std::size_t axis = 0; axis < 3; ++axis) {
          const auto a = static_cast<int>(axis);
          meets[lane] &= static_cast<std::int32_t>(low_m[a] <= boxes.high_m[axis][lane]) &
                         static_cast<std::int32_t>(high_m[a] >= boxes.low_m[axis][lane]);
        }
        any |= meets[lane];
      }
      if (any == 0) continue;
      for (std::size_t lane = 0; lane < kGroup; ++lane)
        if (meets[lane] != 0)
          add_leg(groups_[b * kGroup + lane], from_m, to_m, photons[alive[i]].portals);
    }
  }
}

}  // namespace clamor
