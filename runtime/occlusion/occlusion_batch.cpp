#include "runtime/occlusion/occlusion_batch.h"

#include <algorithm>
#include <array>
#include <atomic>
#include <bit>
#include <optional>
#include <thread>
#include <utility>

#include "common/morton_order.h"
#include "common/parallel_for.h"
#include "runtime/occlusion/fresnel_zone.h"
#include "runtime/occlusion/visibility_cache.h"

namespace clamor {

namespace {

using Lanes = std::uint32_t;  // a bit each

template <class Do>
void for_each(Lanes lanes, const Do& act) {
  for (; lanes != 0; lanes &= lanes - 1) act(static_cast<std::size_t>(std::countr_zero(lanes)));
}

// One line, and what was cast for it.
struct Looked {
  explicit Looked(const LineOfSight& line) : frame(line), zone(frame) {}

  PathFrame frame;
  FresnelZone zone;
  VisibilityEstimate look;
};

// Neighbours, side by side; null beyond the last.
class PacketEstimator {
 public:
  PacketEstimator(const OcclusionGeometry& geometry, std::span<Looked* const> near)
      : geometry_(geometry) {
    std::copy(near.begin(), near.end(), lanes_.begin());
    all_ = static_cast<Lanes>((std::uint64_t{1} << near.size()) - 1);
  }

  void look_straight() {
    for_each(all_, [this](std::size_t l) {
      Looked& one = *lanes_[l];
      ++one.look.rays;
      one.look.straight = geometry_.is_free(one.frame.line.from_m, one.frame.line.to_m);
    });
  }

  // As fresnel_visibility(), with what was cast before.
  void look(int paths_per_ring) {
    const int first_ways = (paths_per_ring + 1) / 2;
    Lanes straight = 0, mixed = 0;
    for_each(all_, [&](std::size_t l) { straight |= lane_if(lanes_[l]->look.straight, l); });
    for (std::size_t r = 0; r < kZoneRings; ++r) {
      const Lanes lanes = r % (kZoneRings / 2) == 0 ? all_ : all_ & ~straight;
      cast(lanes, r, first_ways);
      for_each(lanes, [&](std::size_t l) {
        mixed |= lane_if(ring(l, r).contradicts(lanes_[l]->look.straight), l);
      });
    }
    for_each(all_ & ~mixed, [this](std::size_t l) {
      lanes_[l]->look.around = same_in_all_bands(lanes_[l]->look.straight ? 1 : 0);
    });
    for (std::size_t r = 0; r < kZoneRings; ++r) cast(mixed, r, first_ways);
    std::array<Lanes, kZoneRings> unsettled{};
    for (std::size_t r = 0; r < kZoneRings; ++r)
      for_each(mixed,
               [&](std::size_t l) { unsettled[r] |= lane_if(!lanes_[l]->zone.is_settled(r), l); });
    for (std::size_t r = 0; r < kZoneRings; ++r) cast(unsettled[r], r, paths_per_ring);
    for_each(mixed,
             [this](std::size_t l) { lanes_[l]->look.around = lanes_[l]->zone.visibility(); });
  }

 private:
  // Of those lanes, the ring's ways up to the `count`-th.
  void cast(Lanes lanes, std::size_t r, int count) {
    for (int i = 0; i < count; ++i) {
      Lanes now = 0;
      for_each(lanes, [&](std::size_t l) { now |= lane_if(ring(l, r).cast == i, l); });
      if (now != 0) cast_way(now, r, i);
    }
  }

  void cast_way(Lanes lanes, std::size_t r, int i) {
    std::array<std::optional<Way>, kPacketRays> ways;
    Lanes under_way = 0, free = 0, lost = 0;
    for_each(lanes, [&](std::size_t l) {
      const Looked& one = *lanes_[l];
      ++ring(l, r).cast;
      free |= lane_if(!(one.frame.way_m > 0), l);
      ways[l].emplace(one.frame, one.zone.detour_m(r, i), path_azimuth(r, i));
    });
    under_way = lanes & ~free;
    std::array<PathSegment, kPacketRays> pieces{};
    std::array<const OccluderPlane*, kPacketRays> walls;
    for (std::size_t piece = 1; piece <= Way::kPieces; ++piece)
      for (Lanes casting = under_way; casting != 0;) {
        for_each(casting, [&](std::size_t l) {
          pieces[l] = {ways[l]->at[piece - 1], ways[l]->at[piece]};
          ++lanes_[l]->look.rays;
        });
        geometry_.first_surfaces(pieces, casting, walls);
        for_each(casting, [&](std::size_t l) {
          const Lanes lane = Lanes{1} << l;
          if (walls[l] == nullptr) {
            casting &= ~lane;
            return;
          }
          const Way::Met met = ways[l]->meet(*walls[l], piece, lanes_[l]->frame.line);
          if (met == Way::Met::kFolded) return;
          casting &= ~lane;
          under_way &= ~lane;
          if (met == Way::Met::kLost) lost |= lane;
        });
      }
    free |= under_way;
    for_each(lanes & ~lost, [&](std::size_t l) {
      ++ring(l, r).counted;
      ring(l, r).free += (free >> l & 1) != 0;
    });
  }

  static Lanes lane_if(bool is, std::size_t l) { return is ? Lanes{1} << l : 0; }
  ZoneRing& ring(std::size_t l, std::size_t r) { return lanes_[l]->zone.rings[r]; }

  const OcclusionGeometry& geometry_;
  Lanes all_ = 0;
  std::array<Looked*, kPacketRays> lanes_{};
};

// All of them, with so many ways; then those that an edge cuts with more, if there are to be more.
void look_at_all(const OcclusionGeometry& geometry, std::span<Looked> all, int ways,
                 int more_ways) {
  std::vector<Looked*> lanes;
  for (Looked& one : all) lanes.push_back(&one);
  const auto in_packets = [&](const auto& act) {
    for (std::size_t first = 0; first < lanes.size(); first += kPacketRays) {
      const auto count = std::min(kPacketRays, lanes.size() - first);
      PacketEstimator looks(geometry, std::span(lanes).subspan(first, count));
      act(looks);
    }
  };
  in_packets([&](PacketEstimator& looks) {
    looks.look_straight();
    looks.look(ways);
  });
  if (more_ways <= ways) return;
  std::erase_if(lanes, [](const Looked* one) { return !is_partial(one->look.around); });
  in_packets([&](PacketEstimator& looks) { looks.look(more_ways); });
}

// Lines that a thread looks along at a time.
constexpr std::size_t kTogether = 16 * kPacketRays;

std::vector<VisibilityEstimate> estimate_visibilities(const OcclusionGeometry& geometry,
                                                      std::span<const LineOfSight> lines, int ways,
                                                      int more_ways, unsigned threads) {
  std::vector<VisibilityEstimate> looks(lines.size());
  if (geometry.empty()) {
    for (VisibilityEstimate& look : looks) look = {same_in_all_bands(1), true, 0};
    return looks;
  }
  std::vector<Vec3> starts_m;
  for (const LineOfSight& line : lines) starts_m.emplace_back(line.from_m);
  const std::vector<std::size_t> order = morton_order(starts_m);
  parallel_for(order.size(), kTogether, threads, [&](std::size_t first, std::size_t end) {
    std::vector<Looked> part;
    for (std::size_t i = first; i < end; ++i) part.emplace_back(lines[order[i]]);
    look_at_all(geometry, part, ways, more_ways);
    for (std::size_t i = first; i < end; ++i) looks[order[i]] = part[i - first].look;
  });
  return looks;
}

}  // namespace

std::vector<VisibilityEstimate> estimate_visibilities(const OcclusionGeometry& geometry,
                                                      std::span<const LineOfSight> lines,
                                                      int paths_per_ring, unsigned threads) {
  return estimate_visibilities(geometry, lines, paths_per_ring, 0, threads);
}

std::vector<Bands> fine_visibility(const OcclusionGeometry& geometry, double speed_of_sound_mps,
                                   std::span<const Source* const> sources, const Vec3& place,
                                   unsigned threads) {
  std::vector<std::optional<Vec3f>> starts(sources.size());
  parallel_for(sources.size(), kTogether, threads, [&](std::size_t first, std::size_t end) {
    for (std::size_t i = first; i < end; ++i) starts[i] = geometry.start(*sources[i]);
  });
  std::vector<LineOfSight> lines;
  for (const auto& start_m : starts)
    if (start_m) lines.push_back({*start_m, Vec3f(place), speed_of_sound_mps});
  const std::vector<VisibilityEstimate> looks =
      estimate_visibilities(geometry, lines, kMediumPaths, kFinePaths, threads);
  std::vector<Bands> visibility;
  std::size_t next = 0;
  for (const auto& start_m : starts) visibility.push_back(start_m ? looks[next++].around : Bands{});
  return visibility;
}

}  // namespace clamor
