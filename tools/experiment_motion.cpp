// experiment_motion.cpp: walking, running and flying, heard: clicks and loudness against all
// sources, and what each keyframe takes.
//
// The listener goes round and round in the level, on a path that crosses itself, as long as asked
// for. What is heard is compared with every source mixed along the same way, in stretches of ten
// seconds; both in a free field, since all sources cannot all be looked at for every keyframe.
// Keyframes are timed as a player makes them, with all that hides sources, on one core.
#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <numeric>
#include <ostream>

#include <fmt/format.h>

#include "runtime/auralizer.h"
#include "runtime/click_detector.h"
#include "runtime/programme_loudness.h"
#include "runtime/sight_geometry.h"
#include "runtime/visibility_cache.h"
#include "tools/experiments.h"

namespace clamor {

namespace {

constexpr double kKeyframe_s = static_cast<double>(kKeyframeFrames) / kSampleRate_hz;
constexpr double kStretch_s = 10;
constexpr double kLateKeyframe_ms = 100, kLoudnessGoal_lu = 0.5;

// Two circles of different periods, within the middle of where sources are.
class Way {
 public:
  Way(const ExperimentScene& scene, const Vec3& start) : start_(start) {
    Vec3 low(std::numeric_limits<double>::max()), high(-low);
    for (const Source& source : scene.input().sources) {
      low = glm::min(low, Vec3(source.position_m));
      high = glm::max(high, Vec3(source.position_m));
    }
    const Vec3 room = glm::min(high - start, start - low);
    const double half_m = std::clamp(0.6 * std::min(room.x, room.z), 0.5, 40.0);
    large_m_ = 0.7 * half_m;
    small_m_ = 0.3 * half_m;
  }

  // Along it at a steady speed, nearly: the large circle's.
  Pose at(double way_m) const {
    const double turn = way_m / (large_m_ + small_m_);
    const Vec3 place = start_ + large_m_ * Vec3(1 - std::cos(turn), 0, std::sin(turn)) -
                       Vec3(large_m_, 0, 0) +
                       small_m_ * Vec3(std::cos(0.37 * turn), 0, std::sin(0.37 * turn));
    return {place, -turn, 0};
  }

 private:
  Vec3 start_;
  double large_m_ = 1, small_m_ = 1;
};

std::unique_ptr<Auralizer> auralizer_of(const AuralizerInput& input, const std::string& strategy,
                                        int voices, bool visibility) {
  AuralizerOptions options;
  options.strategy = strategy;
  options.voices = voices;
  options.visibility = visibility;
  auto made = Auralizer::create(AuralizerInput(input), options);
  return made.ok() ? std::move(*made) : nullptr;
}

// The next stretch of what is heard on the way.
Sound next_stretch(Auralizer& auralizer, const Way& way, double speed_mps, double seconds) {
  const auto keyframes = static_cast<std::size_t>(std::llround(seconds / kKeyframe_s));
  Sound sound{{{}, {}}, kSampleRate_hz};
  std::vector<float> block(kEars * kKeyframeFrames);
  for (std::size_t k = 0; k < keyframes; ++k) {
    while (auralizer.wants_keyframe())
      auralizer.make_keyframe(way.at(speed_mps * auralizer.next_keyframe_time_s()));
    auralizer.mix(block);
    for (std::size_t f = 0; f < block.size(); f += kEars)
      for (std::size_t e = 0; e < kEars; ++e) sound.channels[e].push_back(block[f + e]);
  }
  return sound;
}

struct Heard {
  std::size_t clicks = 0, new_clicks = 0;
  std::vector<double> differences_lu;  // momentary, of audible windows
};

void compare(const Sound& sampled, const Sound& whole, Heard& heard) {
  for (std::size_t e = 0; e < kEars; ++e) {
    double peak = 0;
    for (const float sample : whole.channels[e])
      peak = std::max(peak, static_cast<double>(std::abs(sample)));
    const auto known = find_clicks(whole.channels[e], 1e-4 * peak);
    const auto found = find_clicks(sampled.channels[e], 1e-4 * peak);
    heard.clicks += known.size();
    heard.new_clicks += new_clicks(found, known).size();
  }
  const auto ours = programme_loudness(sampled).momentary_lufs;
  const auto all = programme_loudness(whole).momentary_lufs;
  for (std::size_t i = 0; i < std::min(ours.size(), all.size()); ++i)
    if (all[i] > kSilence_lufs) heard.differences_lu.push_back(std::abs(ours[i] - all[i]));
}

double quantile(std::vector<double> values, double share) {
  if (values.empty()) return 0;
  const auto at = static_cast<std::size_t>(share * static_cast<double>(values.size() - 1));
  std::nth_element(values.begin(), values.begin() + static_cast<std::ptrdiff_t>(at), values.end());
  return values[at];
}

// What keyframes take on the way, one after the other; the first, which is made before anything is
// heard, not counted.
std::vector<double> keyframe_times_ms(Auralizer& auralizer, const Way& way, double speed_mps,
                                      double seconds) {
  std::vector<double> times_ms;
  std::vector<float> block(kEars * kKeyframeFrames);
  const auto keyframes = static_cast<std::uint64_t>(std::llround(seconds / kKeyframe_s));
  while (auralizer.statistics().keyframes < keyframes) {
    while (auralizer.wants_keyframe()) {
      auralizer.make_keyframe(way.at(speed_mps * auralizer.next_keyframe_time_s()));
      if (auralizer.statistics().keyframes > 1)
        times_ms.push_back(auralizer.statistics().sampler_ms);
    }
    auralizer.mix(std::span(block));
  }
  return times_ms;
}

// Of the sources that would be chosen in a free field, the share that is hidden.
double occluded_share(const ExperimentScene& scene, const SightGeometry& surfaces, std::size_t k,
                      const Vec3& place) {
  SeededSampler sampler = scene.sampler("priority", k, Estimator::kPower, 1);
  std::size_t hidden = 0, all = 0;
  for (const SampledSource& chosen : sampler.sample(place)) {
    if (all++ % 8 != 0) continue;  // a part of them tells
    hidden += look_closely(surfaces, scene.field().speed_of_sound_mps(), *chosen.source, place) ==
              Bands{};
  }
  return all == 0 ? 0 : static_cast<double>(hidden) / std::ceil(static_cast<double>(all) / 8);
}

// Against n, k and what is hidden; directivity is the bake's.
Result<ReportTable> times_against_all(const ExperimentOptions& options, std::ostream& err) {
  ReportTable table{"time", "Time per keyframe, walking, one core", {}, {}};
  table.columns = {"sources",          "k", "place", "occluded_percent", "median_ms", "p99_ms",
                   "no_rays_median_ms"};
  std::vector<std::size_t> most = options.quick ? std::vector<std::size_t>{200, kQuickSources}
                                                : std::vector<std::size_t>{2000, 10'000, 0};
  for (const std::size_t n : most) {
    const auto scene = ExperimentScene::open(options.level, n);
    if (!scene.ok()) return scene.error();
    const Vec3 usual = options.listener_m.value_or((*scene)->usual_place());
    const SightGeometry surfaces((*scene)->input().mesh, (*scene)->input().materials);
    err << fmt::format("  {} sources", (*scene)->size()) << std::endl;
    for (const int k : {150, 2000, 20'000}) {
      if (static_cast<std::size_t>(k) >= (*scene)->size()) continue;
      for (int place = 0; place < 3; ++place) {
        // Where one is usually, and behind more and more of what there is.
        const Vec3 here = usual + 1.5 * place * Vec3(1, 0.2, 1);
        const Way way(**scene, here);
        const double seconds = options.quick ? 0.3 : 4;
        const auto seeing = auralizer_of((*scene)->input(), "priority", k, true);
        const auto blind = auralizer_of((*scene)->input(), "priority", k, false);
        if (seeing == nullptr || blind == nullptr) return Error("there is nothing to hear.");
        const auto times_ms = keyframe_times_ms(*seeing, way, 1.5, seconds);
        const auto blind_ms = keyframe_times_ms(*blind, way, 1.5, seconds);
        const double hidden =
            occluded_share(**scene, surfaces, static_cast<std::size_t>(k), way.at(0).position_m);
        table.rows.push_back({static_cast<double>((*scene)->size()), static_cast<double>(k),
                              static_cast<double>(place), 100 * hidden, quantile(times_ms, 0.5),
                              quantile(times_ms, 0.99), quantile(blind_ms, 0.5)});
      }
    }
  }
  return table;
}

}  // namespace

Result<ExperimentReport> motion_experiment(const ExperimentOptions& options, std::ostream& err) {
  const auto opened = ExperimentScene::open(options.level, options.quick ? kQuickSources : 0);
  if (!opened.ok()) return opened.error();
  const ExperimentScene& scene = **opened;
  const Vec3 start = options.listener_m.value_or(scene.usual_place());
  const Way way(scene, start);
  const double seconds = options.quick ? 2 : 60 * options.minutes;
  const int k =
      static_cast<int>(std::min<std::size_t>(2000, std::max<std::size_t>(1, scene.size() / 4)));
  ExperimentReport report("motion", "Walking, running, flying: what is heard of it",
                          fmt::format("{} sources, k = {}; {:.0f} s at each speed round {:.1f}, "
                                      "{:.1f}, {:.1f} m",
                                      scene.size(), k, seconds, start.x, start.y, start.z));
  ReportTable heard_table{"heard", "Against all sources", {}, {}};
  heard_table.columns = {"speed_mps",
                         "seconds",
                         "clicks_of_all",
                         "clicks_beyond",
                         "momentary_95_lu",
                         "momentary_worst_lu",
                         "within_half_lu_percent"};
  ReportTable time_table{"keyframes", "Keyframes, with what hides sources", {}, {}};
  time_table.columns = {"speed_mps",
                        "keyframes",
                        "median_ms",
                        "p99_ms",
                        "worst_ms",
                        "later_than_100_ms",
                        "sources_late_for_want_of_rays"};
  Chart chart{.title = "Difference of momentary loudness from all sources",
              .x_label = "share of the time (%)",
              .y_label = "at most (LU)"};
  int colour = 0;
  for (const double speed_mps : {1.5, 5.0, 30.0}) {
    err << fmt::format("  {} m/s", speed_mps) << std::endl;
    const auto sampled = auralizer_of(scene.input(), "priority", k, false);
    const auto whole = auralizer_of(scene.input(), "all", 1, false);
    const auto seeing = auralizer_of(scene.input(), "priority", k, true);
    if (sampled == nullptr || whole == nullptr || seeing == nullptr)
      return Error("there is nothing to hear; bake the level with an emitter.").in(options.level);
    Heard heard;
    for (double done_s = 0; done_s < seconds; done_s += kStretch_s) {
      const double stretch_s = std::min(kStretch_s, seconds - done_s);
      const Sound ours = next_stretch(*sampled, way, speed_mps, stretch_s);
      compare(ours, next_stretch(*whole, way, speed_mps, stretch_s), heard);
    }
    const auto within = std::count_if(heard.differences_lu.begin(), heard.differences_lu.end(),
                                      [](double lu) { return lu <= kLoudnessGoal_lu; });
    const double windows = std::max<double>(1, static_cast<double>(heard.differences_lu.size()));
    heard_table.rows.push_back(
        {speed_mps, seconds, static_cast<double>(heard.clicks),
         static_cast<double>(heard.new_clicks), quantile(heard.differences_lu, 0.95),
         quantile(heard.differences_lu, 1), 100 * static_cast<double>(within) / windows});
    Chart::Series& series = chart.series.emplace_back(
        Chart::Series{.name = fmt::format("{} m/s", speed_mps), .colour = colour++});
    for (int percent = 0; percent <= 100; percent += 2)
      series.points.emplace_back(percent, quantile(heard.differences_lu, percent / 100.0));

    const auto times_ms = keyframe_times_ms(*seeing, way, speed_mps, seconds);
    const auto late = std::count_if(times_ms.begin(), times_ms.end(),
                                    [](double ms) { return ms > kLateKeyframe_ms; });
    time_table.rows.push_back({speed_mps, static_cast<double>(times_ms.size()),
                               quantile(times_ms, 0.5), quantile(times_ms, 0.99),
                               quantile(times_ms, 1), static_cast<double>(late),
                               static_cast<double>(seeing->statistics().late_sources)});
  }
  auto times = times_against_all(options, err);
  if (!times.ok()) return times.error();
  report.claim(
      "Sampling all anew leads to \"rather strong noise artefacts\"; dynamic sampling lets sources "
      "fade in and out one by one (3.4).",
      "Nothing clicks that does not click with all sources, and at any speed loudness follows "
      "theirs: the goals are 0 clicks beyond those of all, half a loudness unit, and no keyframe "
      "later than 100 ms.");
  report.chart(chart, "Windows of 400 ms every 100 ms, BS.1770, in a free field.");
  report.table(std::move(heard_table));
  report.table(std::move(time_table));
  report.table(std::move(*times));
  return report;
}

}  // namespace clamor
