// experiment_motion_times.cpp: time per keyframe against the number of sources, k and the occluded
// share; directivity is that of the bake.
#include <cmath>
#include <memory>
#include <ostream>

#include <fmt/format.h>

#include "runtime/engine/auralizer.h"
#include "runtime/engine/auralizer_input.h"
#include "runtime/engine/auralizer_options.h"
#include "runtime/engine/auralizer_statistics.h"
#include "runtime/occlusion/occlusion_geometry.h"
#include "runtime/occlusion/visibility_cache.h"
#include "tools/experiments/experiment_scene.h"
#include "tools/experiments/experiments.h"
#include "tools/experiments/motion_scene.h"

namespace clamor {

namespace {

std::unique_ptr<Auralizer> auralizer_of(const AuralizerInput& input, int voices, bool visibility) {
  AuralizerOptions options;
  options.voices = voices;
  options.visibility = visibility;
  auto made = Auralizer::create(AuralizerInput(input), options);
  return made.ok() ? std::move(*made) : nullptr;
}

// CPU time of the keyframes along the path, without the first, which is made before playback
// starts.
std::vector<double> times_ms(Auralizer& auralizer, const ListenerPath& path, double seconds) {
  std::vector<double> times;
  std::vector<float> block(kEars * kKeyframeFrames);
  const auto keyframes = static_cast<std::uint64_t>(std::llround(seconds / kKeyframe_s));
  while (auralizer.statistics().keyframes < keyframes) {
    while (auralizer.wants_keyframe()) {
      auralizer.make_keyframe(path.at(1.5 * auralizer.next_keyframe_time_s()));
      if (auralizer.statistics().keyframes > 1) times.push_back(auralizer.statistics().sampler_ms);
    }
    auralizer.mix(std::span(block));
  }
  return times;
}

// Occluded share of the sources that would be chosen in a free field.
double occluded_share(const ExperimentScene& scene, const OcclusionGeometry& surfaces,
                      std::size_t k, const Vec3& place) {
  SeededSampler sampler = scene.sampler("priority", k);
  std::size_t hidden = 0, all = 0;
  for (const SampledSource& chosen : sampler.sample(place)) {
    if (all++ % 8 != 0) continue;  // a sample is enough
    hidden += fine_visibility(surfaces, scene.radiation().speed_of_sound_mps(), *chosen.source,
                              place) == Bands{};
  }
  return all == 0 ? 0 : static_cast<double>(hidden) / std::ceil(static_cast<double>(all) / 8);
}

}  // namespace

Result<ReportTable> keyframe_times(const ExperimentOptions& options, std::ostream& err) {
  ReportTable table{
      "time",
      "Time per keyframe, walking, one core",
      {"sources", "k", "place", "occluded_percent", "median_ms", "p99_ms", "no_rays_median_ms"},
      {}};
  std::vector<std::size_t> max_sources = options.quick ? std::vector<std::size_t>{kQuickSources}
                                                       : std::vector<std::size_t>{2000, 10'000, 0};
  for (const std::size_t n : max_sources) {
    const auto scene = ExperimentScene::open(options.level, n);
    if (!scene.ok()) return scene.error();
    const Vec3 usual = options.place_in(**scene);
    const OcclusionGeometry surfaces((*scene)->input().mesh, (*scene)->input().materials);
    err << fmt::format("  {} sources", (*scene)->size()) << std::endl;
    for (const int k : {150, 2000, 20'000}) {
      if (static_cast<std::size_t>(k) >= (*scene)->size()) continue;
      for (int place = 0; place < (options.quick ? 1 : 3); ++place) {
        // The default position, then positions behind more and more geometry.
        const ListenerPath path((*scene)->input().sources, usual + 1.5 * place * Vec3(1, 0.2, 1));
        const double seconds = options.quick ? 0.3 : 4;
        const auto with_occlusion = auralizer_of((*scene)->input(), k, true);
        const auto without_occlusion = auralizer_of((*scene)->input(), k, false);
        if (with_occlusion == nullptr || without_occlusion == nullptr)
          return Error("there is nothing to hear.");
        const auto occluded_ms = times_ms(*with_occlusion, path, seconds);
        const auto free_ms = times_ms(*without_occlusion, path, seconds);
        const double hidden =
            occluded_share(**scene, surfaces, static_cast<std::size_t>(k), path.at(0).position_m);
        table.rows.push_back({(*scene)->size(), k, place, 100 * hidden, quantile(occluded_ms, 0.5),
                              quantile(occluded_ms, 0.99), quantile(free_ms, 0.5)});
      }
    }
  }
  return table;
}

}  // namespace clamor
