// zone_estimator.h: casts the detour paths of fresnel_visibility.h, of one line or of a packet.
//
// Threads: any.
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>

#include "common/bands.h"
#include "runtime/occlusion/fresnel_zone.h"
#include "runtime/occlusion/occlusion_geometry.h"
#include "runtime/occlusion/visibility_estimate.h"

namespace clamor {

// A set of a packet's lanes, one bit each.
using Lanes = std::uint32_t;

template <class Do>
void for_each_lane(Lanes lanes, const Do& act) {
  for (; lanes != 0; lanes &= lanes - 1) act(static_cast<std::size_t>(std::countr_zero(lanes)));
}

// A line and the state of its estimate.
struct LineState {
  explicit LineState(const LineOfSight& line) : frame(line), zone(frame) {}

  PathFrame frame;
  FresnelZone zone;
  VisibilityEstimate estimate;
};

// Estimates up to N neighbouring lines together, one per lane; lanes beyond the last line are null.
// One line takes single rays, several a packet.
template <std::size_t N>
class ZoneEstimator {
  static_assert(N == 1 || N == kPacketRays);

 public:
  ZoneEstimator(const OcclusionGeometry& geometry, std::span<LineState* const> lines)
      : geometry_(geometry) {
    std::copy(lines.begin(), lines.end(), lanes_.begin());
    all_ = static_cast<Lanes>((std::uint64_t{1} << lines.size()) - 1);
  }

  void test_straight_lines() {
    for_each_lane(all_, [this](std::size_t l) {
      LineState& one = *lanes_[l];
      ++one.estimate.rays;
      one.estimate.line_is_free = geometry_.is_free(one.frame.line.from_m, one.frame.line.to_m);
    });
  }

  // Continues from the paths cast before. Three rings suffice for a source whose straight line is
  // free; behind a wall, sound may pass through any ring.
  void estimate(int paths_per_ring) {
    static_assert(kBandCount == 8, "three rings: the first, the middle and the last");
    const int first_paths = (paths_per_ring + 1) / 2;
    Lanes line_free = 0, mixed = 0;
    for_each_lane(
        all_, [&](std::size_t l) { line_free |= lane_if(lanes_[l]->estimate.line_is_free, l); });
    for (std::size_t r = 0; r < kZoneRings; ++r) {
      const Lanes lanes = r % (kZoneRings / 2) == 0 ? all_ : all_ & ~line_free;
      cast(lanes, r, first_paths);
      for_each_lane(lanes, [&](std::size_t l) {
        mixed |= lane_if(ring(l, r).contradicts(lanes_[l]->estimate.line_is_free), l);
      });
    }
    for_each_lane(all_ & ~mixed, [this](std::size_t l) {
      VisibilityEstimate& estimate = lanes_[l]->estimate;
      estimate.diffracted = same_in_all_bands(estimate.line_is_free ? 1 : 0);
    });
    for (std::size_t r = 0; r < kZoneRings; ++r) cast(mixed, r, first_paths);
    std::array<Lanes, kZoneRings> unsettled{};
    for (std::size_t r = 0; r < kZoneRings; ++r)
      for_each_lane(mixed, [&](std::size_t l) {
        unsettled[r] |= lane_if(!lanes_[l]->zone.is_settled(r), l);
      });
    for (std::size_t r = 0; r < kZoneRings; ++r) cast(unsettled[r], r, paths_per_ring);
    for_each_lane(mixed, [this](std::size_t l) {
      lanes_[l]->estimate.diffracted = lanes_[l]->zone.visibility();
    });
  }

 private:
  // Casts the ring's paths up to number `count` for the given lanes.
  void cast(Lanes lanes, std::size_t r, int count) {
    for (int i = 0; i < count; ++i) {
      Lanes now = 0;
      for_each_lane(lanes, [&](std::size_t l) { now |= lane_if(ring(l, r).cast == i, l); });
      if (now != 0) cast_path(now, r, i);
    }
  }

  void cast_path(Lanes lanes, std::size_t r, int i) {
    std::array<std::optional<DetourPath>, N> paths;
    Lanes under_way = 0, free = 0, lost = 0;
    for_each_lane(lanes, [&](std::size_t l) {
      const LineState& one = *lanes_[l];
      ++ring(l, r).cast;
      free |= lane_if(!(one.frame.length_m > 0), l);
      paths[l].emplace(one.frame, one.zone.detour_m(r, i), path_azimuth(r, i), path_chance(i));
    });
    under_way = lanes & ~free;
    std::array<PathSegment, N> segments{};
    std::array<std::optional<OccluderPlane>, N> walls;
    for (std::size_t segment = 1; segment <= DetourPath::kSegments; ++segment)
      for (Lanes casting = under_way; casting != 0;) {
        for_each_lane(casting, [&](std::size_t l) {
          segments[l] = {paths[l]->points_m[segment - 1], paths[l]->points_m[segment]};
          ++lanes_[l]->estimate.rays;
        });
        if constexpr (N == 1)
          walls[0] = geometry_.first_surface(segments[0].from_m, segments[0].to_m);
        else
          geometry_.first_surfaces(segments, casting, walls);
        for_each_lane(casting, [&](std::size_t l) {
          const Lanes lane = Lanes{1} << l;
          if (!walls[l]) {
            casting &= ~lane;
            return;
          }
          const PathHit hit = paths[l]->hit(*walls[l], segment, lanes_[l]->frame.line);
          if (hit == PathHit::kReflected) return;
          casting &= ~lane;
          under_way &= ~lane;
          if (hit == PathHit::kLost) lost |= lane;
        });
      }
    free |= under_way;
    for_each_lane(lanes & ~lost, [&](std::size_t l) {
      ++ring(l, r).counted;
      ring(l, r).free += (free >> l & 1) != 0;
    });
  }

  static Lanes lane_if(bool is, std::size_t l) { return is ? Lanes{1} << l : 0; }
  ZoneRing& ring(std::size_t l, std::size_t r) { return lanes_[l]->zone.rings[r]; }

  const OcclusionGeometry& geometry_;
  Lanes all_ = 0;
  std::array<LineState*, N> lanes_{};
};

}  // namespace clamor
