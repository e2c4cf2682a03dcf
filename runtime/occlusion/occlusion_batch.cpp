#include "runtime/occlusion/occlusion_batch.h"

#include <algorithm>
#include <array>
#include <bit>
#include <optional>

#include "common/morton_order.h"
#include "common/parallel_for.h"
#include "runtime/occlusion/fresnel_zone.h"
#include "runtime/occlusion/visibility_cache.h"

namespace clamor {

namespace {

// A set of a packet's lanes, one bit each.
using Lanes = std::uint32_t;

template <class Do>
void for_each(Lanes lanes, const Do& act) {
  for (; lanes != 0; lanes &= lanes - 1) act(static_cast<std::size_t>(std::countr_zero(lanes)));
}

// A line and the state of its estimate.
struct LineState {
  explicit LineState(const LineOfSight& line) : frame(line), zone(frame) {}

  PathFrame frame;
  FresnelZone zone;
  VisibilityEstimate estimate;
};

// Estimates neighbouring lines together, one per lane; lanes beyond the last line are null.
class PacketEstimator {
 public:
  PacketEstimator(const OcclusionGeometry& geometry, std::span<LineState* const> lines)
      : geometry_(geometry) {
    std::copy(lines.begin(), lines.end(), lanes_.begin());
    all_ = static_cast<Lanes>((std::uint64_t{1} << lines.size()) - 1);
  }

  void test_straight_lines() {
    for_each(all_, [this](std::size_t l) {
      LineState& one = *lanes_[l];
      ++one.estimate.rays;
      one.estimate.line_is_free = geometry_.is_free(one.frame.line.from_m, one.frame.line.to_m);
    });
  }

  // Follows fresnel_visibility() step by step, and continues from the paths cast before.
  void estimate(int paths_per_ring) {
    const int first_paths = (paths_per_ring + 1) / 2;
    Lanes line_free = 0, mixed = 0;
    for_each(all_,
             [&](std::size_t l) { line_free |= lane_if(lanes_[l]->estimate.line_is_free, l); });
    for (std::size_t r = 0; r < kZoneRings; ++r) {
      const Lanes lanes = r % (kZoneRings / 2) == 0 ? all_ : all_ & ~line_free;
      cast(lanes, r, first_paths);
      for_each(lanes, [&](std::size_t l) {
        mixed |= lane_if(ring(l, r).contradicts(lanes_[l]->estimate.line_is_free), l);
      });
    }
    for_each(all_ & ~mixed, [this](std::size_t l) {
      VisibilityEstimate& estimate = lanes_[l]->estimate;
      estimate.diffracted = same_in_all_bands(estimate.line_is_free ? 1 : 0);
    });
    for (std::size_t r = 0; r < kZoneRings; ++r) cast(mixed, r, first_paths);
    std::array<Lanes, kZoneRings> unsettled{};
    for (std::size_t r = 0; r < kZoneRings; ++r)
      for_each(mixed,
               [&](std::size_t l) { unsettled[r] |= lane_if(!lanes_[l]->zone.is_settled(r), l); });
    for (std::size_t r = 0; r < kZoneRings; ++r) cast(unsettled[r], r, paths_per_ring);
    for_each(mixed, [this](std::size_t l) {
      lanes_[l]->estimate.diffracted = lanes_[l]->zone.visibility();
    });
  }

 private:
  // Casts the ring's paths up to number `count` for the given lanes.
  void cast(Lanes lanes, std::size_t r, int count) {
    for (int i = 0; i < count; ++i) {
      Lanes now = 0;
      for_each(lanes, [&](std::size_t l) { now |= lane_if(ring(l, r).cast == i, l); });
      if (now != 0) cast_path(now, r, i);
    }
  }

  void cast_path(Lanes lanes, std::size_t r, int i) {
    std::array<std::optional<DetourPath>, kPacketRays> paths;
    Lanes under_way = 0, free = 0, lost = 0;
    for_each(lanes, [&](std::size_t l) {
      const LineState& one = *lanes_[l];
      ++ring(l, r).cast;
      free |= lane_if(!(one.frame.length_m > 0), l);
      paths[l].emplace(one.frame, one.zone.detour_m(r, i), path_azimuth(r, i), path_chance(i));
    });
    under_way = lanes & ~free;
    std::array<PathSegment, kPacketRays> segments{};
    std::array<std::optional<OccluderPlane>, kPacketRays> walls;
    for (std::size_t segment = 1; segment <= DetourPath::kSegments; ++segment)
      for (Lanes casting = under_way; casting != 0;) {
        for_each(casting, [&](std::size_t l) {
          segments[l] = {paths[l]->points_m[segment - 1], paths[l]->points_m[segment]};
          ++lanes_[l]->estimate.rays;
        });
        geometry_.first_surfaces(segments, casting, walls);
        for_each(casting, [&](std::size_t l) {
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
    for_each(lanes & ~lost, [&](std::size_t l) {
      ++ring(l, r).counted;
      ring(l, r).free += (free >> l & 1) != 0;
    });
  }

  static Lanes lane_if(bool is, std::size_t l) { return is ? Lanes{1} << l : 0; }
  ZoneRing& ring(std::size_t l, std::size_t r) { return lanes_[l]->zone.rings[r]; }

  const OcclusionGeometry& geometry_;
  Lanes all_ = 0;
  std::array<LineState*, kPacketRays> lanes_{};
};

// Estimates all lines with `paths` per ring, and those that an edge partly occludes with
// `more_paths`, if that is larger.
void estimate_all(const OcclusionGeometry& geometry, std::span<LineState> all, int paths,
                  int more_paths) {
  std::vector<LineState*> lines;
  for (LineState& one : all) lines.push_back(&one);
  const auto in_packets = [&](const auto& act) {
    for (std::size_t first = 0; first < lines.size(); first += kPacketRays) {
      const auto count = std::min(kPacketRays, lines.size() - first);
      PacketEstimator packet(geometry, std::span(lines).subspan(first, count));
      act(packet);
    }
  };
  in_packets([&](PacketEstimator& packet) {
    packet.test_straight_lines();
    packet.estimate(paths);
  });
  if (more_paths <= paths) return;
  std::erase_if(lines, [](const LineState* one) { return !is_partial(one->estimate.diffracted); });
  in_packets([&](PacketEstimator& packet) { packet.estimate(more_paths); });
}

// Lines that a thread takes at a time.
constexpr std::size_t kLinesPerTask = 16 * kPacketRays;

std::vector<VisibilityEstimate> estimate_visibilities(const OcclusionGeometry& geometry,
                                                      std::span<const LineOfSight> lines, int paths,
                                                      int more_paths, unsigned threads) {
  std::vector<VisibilityEstimate> estimates(lines.size());
  if (geometry.empty()) {
    for (VisibilityEstimate& estimate : estimates)
      estimate = {.diffracted = same_in_all_bands(1), .line_is_free = true};
    return estimates;
  }
  std::vector<Vec3> starts_m;
  for (const LineOfSight& line : lines) starts_m.emplace_back(line.from_m);
  const std::vector<std::size_t> order = morton_order(starts_m);
  parallel_for(order.size(), kLinesPerTask, threads, [&](std::size_t first, std::size_t end) {
    std::vector<LineState> task;
    for (std::size_t i = first; i < end; ++i) task.emplace_back(lines[order[i]]);
    estimate_all(geometry, task, paths, more_paths);
    for (std::size_t i = first; i < end; ++i) estimates[order[i]] = task[i - first].estimate;
  });
  return estimates;
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
  std::vector<Bands> visibility(sources.size());
  std::vector<std::optional<LineOfSight>> line_of(sources.size());
  const auto for_each_source = [&](const auto& act) {
    parallel_for(sources.size(), kLinesPerTask, threads, [&](std::size_t first, std::size_t end) {
      for (std::size_t i = first; i < end; ++i) act(i);
    });
  };
  for_each_source([&](std::size_t i) {
    if (const auto origin_m = geometry.ray_origin(*sources[i]))
      line_of[i] = {*origin_m, Vec3f(place), speed_of_sound_mps};
  });
  std::vector<LineOfSight> lines;
  std::vector<std::size_t> estimate_of(sources.size());
  for (std::size_t i = 0; i < sources.size(); ++i) {
    if (!line_of[i] || sources[i]->is_image) continue;
    estimate_of[i] = lines.size();
    lines.push_back(*line_of[i]);
  }
  std::vector<VisibilityEstimate> estimates =
      estimate_visibilities(geometry, lines, kMediumPaths, kFinePaths, threads);
  for_each_source([&](std::size_t i) {
    if (!line_of[i]) return;
    if (sources[i]->is_image) {
      visibility[i] =
          estimate_visibility(geometry, *sources[i], *line_of[i], kMediumPaths, true).diffracted;
      return;
    }
    VisibilityEstimate& estimate = estimates[estimate_of[i]];
    if (sources[i]->is_emitter) add_edges(geometry, *line_of[i], estimate);
    visibility[i] = estimate.diffracted;
  });
  return visibility;
}

}  // namespace clamor
