// experiment_motion.cpp: walking, running and flying: clicks and loudness against all sources, and
// the time of each keyframe.
//
// The listener moves along a closed path through the level and hears what `clamor play` plays: from
// the file, with occlusion. The whole sound is searched for clicks; around each click, all sources
// are mixed to see whether they have it, too.
//
// Mixing all sources for ten minutes would take too long (2000 seconds per second and million
// sources). Loudness is compared in readings of 400 ms spread evenly over the path, each from a
// track that begins shortly before it (motion_scene.h), in a free field. Three differences are
// reported:
//
//   heard   the mixed sound against that of all sources, with their random interference
//   chance  all sources with other polarities and other random emitter delays, which are equally
//           exact, against all sources
//   power   the sum of the powers in the keyframes, against that of all sources: the error of
//           sampling alone, without interference
#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <ostream>

#include <fmt/format.h>

#include "formats/bake_file/bake_file.h"
#include "runtime/engine/auralizer.h"
#include "runtime/engine/auralizer_input.h"
#include "runtime/engine/auralizer_options.h"
#include "runtime/engine/auralizer_statistics.h"
#include "tools/analysis/click_detector.h"
#include "tools/analysis/programme_loudness.h"
#include "tools/experiments/experiment_scene.h"
#include "tools/experiments/experiments.h"
#include "tools/experiments/motion_scene.h"

namespace clamor {

namespace {

constexpr double kLateKeyframe_ms = 100, kLoudnessGoal_lu = 0.5;
constexpr std::size_t kChunk_frames = 10 * kSampleRate_hz;
constexpr std::size_t kReadingKeyframes = 20;  // 400 ms
constexpr std::uint64_t kRoll = 7;

struct FoundClick {
  std::size_t ear = 0;
  double time_s = 0;
};

// The clicks that are not too faint to be heard.
std::vector<Click> audible_clicks(const std::vector<float>& ear) {
  constexpr double kAudibleFromPeak = 1e-4;
  double peak = 0;
  for (const float sample : ear) peak = std::max(peak, static_cast<double>(std::abs(sample)));
  return find_clicks(ear, kAudibleFromPeak * peak);
}

struct Playback {
  std::vector<FoundClick> clicks;
  std::vector<double> times_ms;  // CPU time of each keyframe
  std::size_t held = 0, late = 0;
  std::uint64_t late_sources = 0;
};

void find_clicks_in(std::array<std::vector<float>, kEars>& ears, double end_s, Playback& playback) {
  for (std::size_t e = 0; e < kEars; ++e) {
    for (const Click& click : audible_clicks(ears[e]))
      playback.clicks.push_back(
          {e, end_s - static_cast<double>(ears[e].size() - click.frame) / kSampleRate_hz});
    ears[e].clear();
  }
}

Playback play(Auralizer& auralizer, const ListenerPath& path, double speed_mps, double seconds) {
  Playback playback;
  // When each keyframe would be ready on a core of its own: keyframes are made as soon as the queue
  // has room, a few ahead of the one that is needed at the beginning of its segment.
  constexpr double kPeriod_ms = 1e3 * kKeyframe_s;
  const auto ahead = static_cast<double>(keyframes_ahead(kKeyframeFrames));
  double done_ms = 0;
  std::array<std::vector<float>, kEars> ears;
  std::vector<float> block(kEars * kKeyframeFrames);
  const auto blocks = static_cast<std::size_t>(std::llround(seconds / kKeyframe_s));
  std::size_t made = 0;
  for (std::size_t b = 1; b <= blocks; ++b) {
    while (auralizer.wants_keyframe()) {
      auralizer.make_keyframe(path.at(speed_mps * auralizer.next_keyframe_time_s()));
      if (made++ == 0) continue;  // made before playback starts
      playback.times_ms.push_back(auralizer.statistics().sampler_ms);
      const auto number = static_cast<double>(made - 1);
      done_ms = std::max(done_ms, (number - 1 - ahead) * kPeriod_ms) + playback.times_ms.back();
      const double late_ms = done_ms - (number - 1) * kPeriod_ms;
      playback.held += late_ms > 0;
      playback.late += late_ms > kLateKeyframe_ms;
    }
    auralizer.mix(block);
    for (std::size_t f = 0; f < block.size(); f += kEars)
      for (std::size_t e = 0; e < kEars; ++e) ears[e].push_back(block[f + e]);
    if (ears[0].size() >= kChunk_frames || b == blocks)
      find_clicks_in(ears, static_cast<double>(b) * kKeyframe_s, playback);
  }
  playback.late_sources = auralizer.statistics().late_sources;
  return playback;
}

// Counts the clicks that are not in the mix of all sources. That mix begins at a common multiple of
// the detector's hop and of keyframes, so that the detector sees the same frames.
std::size_t clicks_beyond_all(const Playback& playback, const MotionScene& scene,
                              const ListenerPath& path, double speed_mps) {
  constexpr double kGrid_s = 0.32;  // 15 hops of 1024 frames, 16 keyframes of 960
  constexpr double kChunk_s = static_cast<double>(kChunk_frames) / kSampleRate_hz;
  std::size_t beyond = 0;
  for (const FoundClick& click : playback.clicks) {
    const double chunk_s = kChunk_s * std::floor(click.time_s / kChunk_s);
    const double before = std::floor((click.time_s - chunk_s) / kGrid_s - 0.5);
    const double from_s = chunk_s + kGrid_s * std::max(0.0, before);
    const auto first = static_cast<std::uint64_t>(std::llround(from_s / kKeyframe_s));
    const RenderedSegment whole = render_segment(scene, path, speed_mps, "all", 1, first, 32);
    const Click here{static_cast<std::size_t>((click.time_s - from_s) * kSampleRate_hz), 0};
    const auto known = audible_clicks(whole.sound.channels[click.ear]);
    beyond += new_clicks(std::span(&here, 1), known).size();
  }
  return beyond;
}

// Absolute differences from all sources, of each reading.
struct Differences {
  std::vector<double> heard_lu, chance_lu, power_lu;
  std::vector<double> few_lu, many_lu;  // heard, with a quarter and with four times the voices

  std::array<std::vector<double>*, 5> all() {
    return {&heard_lu, &chance_lu, &power_lu, &few_lu, &many_lu};
  }
};

double power_lu(const RenderedSegment& a, const RenderedSegment& b) {
  const auto sum = [](const RenderedSegment& one) {
    return std::accumulate(one.powers.begin(), one.powers.end(), 0.0);
  };
  return std::abs(10 * std::log10(sum(a) / sum(b)));
}

Differences differences(const MotionScene& scene, const MotionScene& rolled,
                        const ListenerPath& path, double speed_mps, double seconds, int readings,
                        std::size_t k) {
  Differences result;
  const double every_s = std::max(kKeyframe_s, seconds / readings);
  for (int r = 0; r < readings; ++r) {
    const auto first = static_cast<std::uint64_t>(every_s * r / kKeyframe_s);
    const auto stretch = [&](const MotionScene& of, const char* strategy, std::size_t voices) {
      return render_segment(of, path, speed_mps, strategy, voices, first, kReadingKeyframes);
    };
    const auto loudness_lufs = [](const RenderedSegment& one) {
      return programme_loudness(one.sound).momentary_lufs.at(0);
    };
    const RenderedSegment whole = stretch(scene, "all", 1);
    const double all_lufs = loudness_lufs(whole);
    if (!(all_lufs > kSilence_lufs)) continue;
    const auto off_lu = [&](const RenderedSegment& one) {
      return std::abs(loudness_lufs(one) - all_lufs);
    };
    const RenderedSegment sampled = stretch(scene, "priority", k);
    result.heard_lu.push_back(off_lu(sampled));
    result.power_lu.push_back(power_lu(sampled, whole));
    result.chance_lu.push_back(off_lu(stretch(rolled, "all", 1)));
    result.few_lu.push_back(off_lu(stretch(scene, "priority", std::max<std::size_t>(1, k / 4))));
    result.many_lu.push_back(off_lu(stretch(scene, "priority", 4 * k)));
  }
  return result;
}

double worst(const std::vector<double>& values) { return quantile(values, 1); }

// Describes the readings.
std::string said_of(const Differences& all) {
  if (all.heard_lu.empty()) return "In no reading was anything loud enough to be compared.";
  const double power_lu = worst(all.power_lu), heard_lu = quantile(all.heard_lu, 0.95),
               chance_lu = quantile(all.chance_lu, 0.95);
  const auto beside_goal = [](double lu) {
    return lu <= kLoudnessGoal_lu ? "which meets" : "which misses";
  };
  return fmt::format(
             "The power of the sample is within {:.2f} LU of that of all in every reading, {} the "
             "goal of {} LU. As heard, 95 % of readings are within {:.2f} LU, {} it; all sources "
             "with other signs of the reflections, as exact, are within {:.2f} LU. ",
             power_lu, beside_goal(power_lu), kLoudnessGoal_lu, heard_lu, beside_goal(heard_lu),
             chance_lu) +
         (heard_lu <= chance_lu ? "So what is heard differs by no more than chance. "
                                : "So what is heard differs by more than chance makes it. ") +
         fmt::format(
             "A quarter of the voices are within {:.2f} LU, four times as many within {:.2f}.",
             quantile(all.few_lu, 0.95), quantile(all.many_lu, 0.95));
}

Chart loudness_chart(const Differences& all) {
  Chart chart{.title = "Difference of momentary loudness from all sources",
              .x_label = "share of the readings (%)",
              .y_label = "at most (LU)"};
  int colour = 0;
  for (const auto& [name, values] : {std::pair("heard", &all.heard_lu),
                                     std::pair("chance: all, other polarities", &all.chance_lu),
                                     std::pair("power", &all.power_lu)}) {
    Chart::Series& series = chart.series.emplace_back();
    series = {.name = name, .colour = colour++};
    for (int percent = 0; percent <= 100; percent += 2)
      series.points.emplace_back(percent, quantile(*values, percent / 100.0));
  }
  return chart;
}

// Tables of all speeds.
class MotionFigures {
 public:
  void add(double speed_mps, double seconds, const Playback& playback, std::size_t beyond,
           Differences now) {
    beyond_ += beyond;
    late_ += playback.late;
    clicks_.rows.push_back({speed_mps, seconds, playback.clicks.size(), beyond});
    const std::vector<double>& took_ms = playback.times_ms;
    times_.rows.push_back({speed_mps, took_ms.size(), quantile(took_ms, 0.5),
                           quantile(took_ms, 0.99), worst(took_ms), playback.held, playback.late,
                           playback.late_sources});
    loudness_.rows.push_back(
        {speed_mps, now.heard_lu.size(), quantile(now.heard_lu, 0.95), worst(now.heard_lu),
         quantile(now.chance_lu, 0.95), worst(now.chance_lu), quantile(now.power_lu, 0.95),
         worst(now.power_lu), quantile(now.few_lu, 0.95), quantile(now.many_lu, 0.95)});
    for (std::size_t i = 0; i < all_.all().size(); ++i)
      all_.all()[i]->insert(all_.all()[i]->end(), now.all()[i]->begin(), now.all()[i]->end());
  }

  void write_to(ReportPage& report, ReportTable against) && {
    report.claim(
        "Sampling all anew leads to \"rather strong noise artefacts\"; dynamic sampling lets "
        "sources fade in and out one by one (3.4).",
        fmt::format("{} clicks that all sources do not have; {} keyframes later than {:.0f} ms. {}",
                    beyond_, late_, kLateKeyframe_ms, said_of(all_)));
    report.chart(
        loudness_chart(all_),
        "Readings of 400 ms spread over the path, BS.1770, in a free field, at all speeds; "
        "chance is the difference of all sources with other random polarities.");
    report.table(std::move(clicks_));
    report.table(std::move(loudness_));
    report.paragraph(
        "Keyframes are timed by the thread's CPU time, as if it had a core to itself. A block is "
        "held "
        "when its keyframe is not ready in time, including the delay of those before it.");
    report.table(std::move(times_));
    report.table(std::move(against));
  }

 private:
  ReportTable clicks_{"clicks",
                      "Clicks over the whole time",
                      {"speed_mps", "seconds", "clicks", "clicks_beyond_all"},
                      {}};
  ReportTable loudness_{
      "loudness",
      "Momentary loudness against all sources",
      {"speed_mps", "readings", "heard_95_lu", "heard_worst_lu", "chance_95_lu", "chance_worst_lu",
       "power_95_lu", "power_worst_lu", "quarter_k_95_lu", "four_k_95_lu"},
      {}};
  ReportTable times_{"keyframes",
                     "Keyframes, with occlusion",
                     {"speed_mps", "keyframes", "median_ms", "p99_ms", "worst_ms", "held",
                      "later_than_100_ms", "sources_late_for_want_of_rays"},
                     {}};
  Differences all_;
  std::size_t beyond_ = 0, late_ = 0;
};

}  // namespace

Result<ReportPage> motion_experiment(const ExperimentOptions& options, std::ostream& err) {
  const auto opened = options.open_scene();
  if (!opened.ok()) return opened.error();
  auto file = BakeFile::open(options.level, FileAccess::kMap);
  if (!file.ok()) return file.error();
  const auto baked = std::make_shared<const BakeFile>(std::move(*file));
  const AuralizerInput& input = (*opened)->input();
  const Vec3 start = options.place_in(**opened);
  const ListenerPath path(input.sources, start);
  const MotionScene scene(input), rolled(input, kRoll);
  const double seconds = options.quick ? 2 : 60 * options.minutes;
  const int readings = options.quick ? 3 : options.readings;
  const std::size_t max_sources =
      options.quick ? std::max<std::size_t>(1, input.sources.size() / 4) : input.sources.size();
  const std::size_t k = std::min(static_cast<std::size_t>(options.voices), max_sources);
  ReportPage report(
      "motion", "Walking, running and flying",
      fmt::format(
          "The bake {}: {} sources, k = {}; {:.0f} s at each speed round {:.1f}, {:.1f}, {:.1f} m; "
          "{} readings of 400 ms of each against all sources",
          options.level, input.sources.size(), k, seconds, start.x, start.y, start.z, readings));
  MotionFigures figures;
  for (const double speed_mps : {1.5, 5.0, 30.0}) {
    err << fmt::format("  {} m/s", speed_mps) << std::endl;
    AuralizerOptions player;
    player.voices = static_cast<int>(k);
    // Late decoding delays voices, which has nothing to do with motion: wait for it.
    player.first_sounds_s = 60;
    const auto auralizer = Auralizer::create(baked, player);
    if (!auralizer.ok()) return auralizer.error();
    const Playback playback = play(**auralizer, path, speed_mps, seconds);
    figures.add(speed_mps, seconds, playback, clicks_beyond_all(playback, scene, path, speed_mps),
                differences(scene, rolled, path, speed_mps, seconds, readings, k));
  }
  auto against = keyframe_times(options, err);
  if (!against.ok()) return against.error();
  std::move(figures).write_to(report, std::move(*against));
  return report;
}

}  // namespace clamor
