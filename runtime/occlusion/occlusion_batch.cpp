#include "runtime/occlusion/occlusion_batch.h"

#include <algorithm>
#include <optional>

#include "common/morton_order.h"
#include "common/parallel_for.h"
#include "runtime/occlusion/visibility_cache.h"
#include "runtime/occlusion/zone_estimator.h"

namespace clamor {

namespace {

// Estimates all lines with `paths` per ring, and those that an edge partly occludes with
// `more_paths`, if that is larger.
void estimate_all(const OcclusionGeometry& geometry, std::span<LineState> all, int paths,
                  int more_paths) {
  std::vector<LineState*> lines;
  for (LineState& one : all) lines.push_back(&one);
  const auto in_packets = [&](const auto& act) {
    for (std::size_t first = 0; first < lines.size(); first += kPacketRays) {
      const auto count = std::min(kPacketRays, lines.size() - first);
      ZoneEstimator<kPacketRays> packet(geometry, std::span(lines).subspan(first, count));
      act(packet);
    }
  };
  in_packets([&](ZoneEstimator<kPacketRays>& packet) {
    packet.test_straight_lines();
    packet.estimate(paths);
  });
  if (more_paths <= paths) return;
  std::erase_if(lines, [](const LineState* one) { return !is_partial(one->estimate.diffracted); });
  in_packets([&](ZoneEstimator<kPacketRays>& packet) { packet.estimate(more_paths); });
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
    lines.push_back(sources[i]->is_emitter ? either_way(*line_of[i]) : *line_of[i]);
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
