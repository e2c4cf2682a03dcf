// experiment_field.cpp: what voices, taps of a field and both together cost, and how far each is
// from the sound of all sources.
//
// A listener stands and then walks, over headphones and without occlusion, so that all sources are
// heard. All of them as voices are the reference; the CPU time is that of the sampler and the mixer
// together.
#include <algorithm>
#include <array>
#include <cmath>
#include <ostream>
#include <utility>

#include <fmt/format.h>

#include "common/cpu_time.h"
#include "runtime/engine/auralizer.h"
#include "runtime/engine/auralizer_input.h"
#include "runtime/engine/auralizer_options.h"
#include "tools/analysis/programme_loudness.h"
#include "tools/experiments/experiment_scene.h"
#include "tools/experiments/experiments.h"
#include "tools/experiments/motion_scene.h"

namespace clamor {

namespace {

constexpr double kWalk_mps = 1.5;

struct MixedSound {
  Sound sound;
  double cpu_s = 0, mixing_s = 0;  // per second of sound
};

// How a sample is mixed: as voices, or all but so many of its sources as taps.
struct WayOfMixing {
  const char* name;
  Mixing mixing;
  std::size_t field_voices;
};
constexpr std::array<WayOfMixing, 3> kWays = {
    {{"voices", Mixing::kVoices, 0}, {"taps", Mixing::kField, 0}, {"both", Mixing::kField, 256}}};

Result<MixedSound> mixed(const AuralizerInput& input, const OutputFormat& output,
                         const WayOfMixing& way, std::size_t k, const ListenerPath& path,
                         double speed_mps, double seconds) {
  AuralizerOptions options;
  options.voices = static_cast<int>(k);
  options.mixing = way.mixing;
  options.field_voices = way.field_voices;
  options.visibility = false;
  options.output = output;
  const auto made = Auralizer::create(input, options);
  if (!made.ok()) return made.error();
  Auralizer& auralizer = **made;
  MixedSound result;
  result.sound = {{{}, {}}, kSampleRate_hz, {}};
  std::vector<float> block(kEars * kKeyframeFrames);
  const auto blocks = static_cast<std::size_t>(std::llround(seconds / kKeyframe_s));
  double started_s = 0;
  for (std::size_t b = 0; b < blocks; ++b) {
    while (auralizer.wants_keyframe())
      auralizer.make_keyframe(path.at(speed_mps * auralizer.next_keyframe_time_s()));
    // Keyframes that were made before playback starts are no part of the cost.
    if (b == 0) started_s = process_time_s();
    const double mixes_s = process_time_s();
    auralizer.mix(block);
    if (b > 0) result.mixing_s += process_time_s() - mixes_s;
    for (std::size_t f = 0; f < block.size(); f += kEars)
      for (std::size_t e = 0; e < kEars; ++e) result.sound.channels[e].push_back(block[f + e]);
  }
  result.cpu_s = (process_time_s() - started_s) / seconds;
  result.mixing_s /= seconds;
  return result;
}

struct Errors {
  double worst_lu = 0, within_95_lu = 0, l2_db = 0;
};

Errors errors_of(const Sound& sound, const Sound& all) {
  const auto heard = programme_loudness(sound).momentary_lufs,
             exact = programme_loudness(all).momentary_lufs;
  std::vector<double> off_lu;
  for (std::size_t i = 0; i < exact.size(); ++i)
    if (exact[i] > kSilence_lufs)
      off_lu.push_back(std::abs(std::max(heard[i], kSilence_lufs) - exact[i]));
  const double whole = energy(all);
  const double lost = whole - 2 * inner_product(sound, all) + energy(sound);
  return {quantile(off_lu, 1), quantile(off_lu, 0.95),
          10 * std::log10(std::max(lost / whole, 1e-12))};
}

// The least CPU time, over a listener's rows, for which each way of mixing is within the goal in
// every reading, in words.
std::string cost_in_words(const ReportTable& table) {
  constexpr double kGoal_lu = 0.5;
  std::vector<std::string> parts;
  for (const std::string& name : names_of(table)) {
    const auto worst_lu = column_of(table, "worst_lu", name),
               cpu_s = column_of(table, "cpu_s", name);
    double min_cpu_s = HUGE_VAL;
    for (std::size_t i = 0; i < cpu_s.size(); ++i)
      if (worst_lu[i] <= kGoal_lu) min_cpu_s = std::min(min_cpu_s, cpu_s[i]);
    parts.push_back(min_cpu_s < HUGE_VAL ? fmt::format("{} {:.2f} s per second", name, min_cpu_s)
                                         : fmt::format("{} more than was tried ({:.2f} LU at best)",
                                                       name, *std::ranges::min_element(worst_lu)));
  }
  return fmt::format("To be within {} LU of all sources in every reading costs {}. ", kGoal_lu,
                     listed(parts));
}

}  // namespace

Result<ReportPage> field_experiment(const ExperimentOptions& options, std::ostream& err) {
  const auto opened = options.open_scene();
  if (!opened.ok()) return opened.error();
  const AuralizerInput& input = (*opened)->input();
  const auto output = OutputFormat::from_options(true, "", false, "");
  if (!output.ok()) return output.error();
  const Vec3 start = options.place_in(**opened);
  const ListenerPath path(input.sources, start);
  const double seconds = options.quick ? 0.6 : 4;
  const std::size_t n = input.sources.size();
  std::vector<std::size_t> sizes;
  for (const std::size_t k : {n / 400, n / 100, n / 40, n / 10, n / 4, n})
    if (k >= 50) sizes.push_back(k);
  ReportTable table{
      "field",
      "Against all sources as voices",
      {"mixed_as", "listener", "k", "cpu_s", "mixing_s", "worst_lu", "within_95_lu", "l2_db"},
      {}};
  std::string text;
  std::vector<Chart> charts;
  for (const auto& [listener, speed_mps] :
       {std::pair("walks", kWalk_mps), std::pair("stands", 0.0)}) {
    err << "  " << listener << std::endl;
    const auto all = mixed(input, *output, kWays[0], n, path, speed_mps, seconds);
    if (!all.ok()) return all.error();
    for (const WayOfMixing& way : kWays)
      for (const std::size_t k : sizes) {
        if (way.mixing == Mixing::kVoices && k == n) continue;
        if (way.mixing == Mixing::kField && k <= way.field_voices) continue;
        const auto one = mixed(input, *output, way, k, path, speed_mps, seconds);
        if (!one.ok()) return one.error();
        const Errors off = errors_of(one->sound, all->sound);
        table.rows.push_back({way.name, listener, k, one->cpu_s, one->mixing_s, off.worst_lu,
                              off.within_95_lu, off.l2_db});
      }
    const ReportTable rows = rows_with(table, "listener", listener);
    text += fmt::format("A listener who {}, all {} sources as voices: {:.2f} s per second. ",
                        listener, n, all->cpu_s) +
            cost_in_words(rows);
    for (const auto& [column, label] : {std::pair("worst_lu", "loudness, at worst (LU)"),
                                        std::pair("l2_db", "relative L2 (dB)")}) {
      Chart chart{.title = fmt::format("A listener who {}", listener),
                  .x_label = "CPU time (s per second of sound)",
                  .y_label = label,
                  .log_x = true,
                  .width = 480,
                  .height = 320};
      plot(chart, rows, "cpu_s", column);
      for (Chart::Series& series : chart.series) std::ranges::sort(series.points);
      charts.push_back(std::move(chart));
    }
  }
  ReportPage report("field", "Voices, taps of a field, and both",
                    fmt::format("The bake {}: {} sources, binaural, without occlusion; {} s round "
                                "{:.1f}, {:.1f}, {:.1f} m, and as long at 1.5 m/s",
                                options.level, n, seconds, start.x, start.y, start.z));
  report.claim("Few of the sources are mixed, and the others are left out (3.4).", text);
  report.charts(charts, 2,
                "Error against the CPU time of choosing and mixing k sources: all as voices, all "
                "as taps of a response per signal, or the 256 loudest as voices and the others as "
                "taps. Loudness is that of all readings of 400 ms.");
  report.table(std::move(table));
  return report;
}

}  // namespace clamor
