// stadium_perception.cpp: the paper's figure 5: audible differences between a sample and all
// sources.
#include <algorithm>
#include <cmath>
#include <mutex>
#include <ostream>

#include <fmt/format.h>

#include "tools/analysis/null_distribution.h"
#include "tools/experiments/experiment_scene.h"
#include "tools/experiments/experiments.h"

namespace clamor {

namespace {

// Scales a sound to the energy of `like`.
Sound brought_to(const Sound& like, Sound sound) {
  const auto gain = static_cast<float>(std::sqrt(energy(like) / energy(sound)));
  for (auto& channel : sound.channels)
    for (float& sample : channel) sample *= gain;
  return sound;
}

// Waveform measures depend on inaudible phases, so they do not count.
bool counts(const Difference& difference) {
  const Measure measure = difference.info->measure;
  return measure != Measure::kL2 && measure != Measure::kRenormalisedL2 &&
         measure != Measure::kCorrelation && difference.worst() != nullptr;
}

// Measures of one sample against the null distribution: a row per measure in the table, and one in
// the summary.
void add_rows(const std::string& strategy, std::size_t k,
              const std::vector<Difference>& differences, const NullDistribution& chance,
              ReportTable& table, ReportTable& summary) {
  int beyond = 0, taken = 0;
  double logs = 0;    // of the ratios to the 95th percentile of chance
  std::string which;  // keys of the measures beyond chance
  for (const Difference& difference : differences) {
    if (!counts(difference)) continue;
    const double size = difference.size();
    const double by_chance = chance.size_95(difference.info->measure);
    if (size == 0 && by_chance == 0) continue;
    ++taken;
    const double ratio = std::clamp(size / std::max(by_chance, 1e-9), 0.01, 100.0);
    logs += std::log(ratio);
    if (size > by_chance) {
      ++beyond;
      which += (which.empty() ? "" : "; ") + std::string(difference.info->key);
    }
    table.rows.push_back({strategy, difference.info->key, k, size, by_chance, ratio});
  }
  summary.rows.push_back({strategy, k, beyond, taken, std::exp(logs / std::max(taken, 1)), which});
}

void report_perception(ReportTable summary, ReportTable table,
                       const std::vector<std::size_t>& sizes, int rolls, ReportPage& report) {
  const std::vector<double> ticks(sizes.begin(), sizes.end());
  Chart share{
      .title = "Figure 5: measures that tell the sample from an exact rendering",
      .x_label = "k, sources mixed",
      .y_label = "measures beyond chance (%)",
      .log_x = true,
      .x_ticks = ticks,
      .y_range = {{0, 100}},
      .zones = {
          {32, 181, "paper: bad"}, {1448, 4096, "satisfactory"}, {6000, 32768, "very close"}}};
  Chart typical{.title = "Figure 5: distance beyond chance, geometric mean of the measures",
                .x_label = "k, sources mixed",
                .y_label = "difference / 95th percentile of chance",
                .log_x = true,
                .log_y = true,
                .x_ticks = ticks};
  plot(typical, summary, "k", "typical_ratio");
  ReportTable percent = summary;
  for (auto& row : percent.rows)
    row[2] = 100 * std::get<double>(row[2]) / std::max(std::get<double>(row[3]), 1.0);
  plot(share, percent, "k", "beyond");
  const std::vector<double> ends = {ticks.front(), ticks.back()};
  plot_curve(typical, "chance", ends, [](double) { return 1; });
  plot_curve(share, "chance", ends, [](double) { return 5; });

  report.heading("Figure 5: audible differences");
  report.claim(
      "Eight listeners, volumes alike: \"approximations with up to 128 samples were clearly "
      "distinguished as bad approximations. 2048 samples already provided a satisfactory "
      "approximation quality for most subjects. For 8192 and more samples, the approximation "
      "quality "
      "was very close to the original.\" (5.1)",
      fmt::format(
          "Measures instead of listeners (clamor compare lists them with their sources), volumes "
          "alike. The yardstick is the crowd itself: {} exact renderings with other phases. "
          "A measure counts where its difference is beyond the 95th percentile of theirs.",
          rolls));
  report.charts({share, typical}, 1,
                "Shaded: the paper's listeners. Dashed: chance, as the 95th percentile makes it. "
                "The paper's strategies with --estimator amplitude, renormalised; priority "
                "with power.");
  report.table(std::move(summary));
  report.table(std::move(table));
}

}  // namespace

void perception(const ExperimentScene& scene, const ExperimentOptions& options, double seconds,
                const Sound& all, const std::vector<std::size_t>& sizes, ReportPage& report,
                std::ostream& err) {
  const Vec3 place = options.place_in(scene);
  const SoundAnalysis original = analyse(all, SoundKind::kProgramme);
  const auto difference_of = [&](const std::string& strategy, std::size_t k, std::uint64_t phases) {
    const SeededSampler sampler = scene.sampler(strategy, k, estimator_of(strategy));
    const Sound sound = scene.render(*sampler.sampler, place, seconds, phases);
    return compare(original, analyse(brought_to(all, sound), SoundKind::kProgramme));
  };
  int done = 0;
  std::mutex printing;
  // Differences between the original and exact renderings with other phases.
  const NullDistribution chance = null_distribution(options.rolls, [&](std::uint32_t roll) {
    auto differences = difference_of("all", 1, 1000 + roll);
    const std::scoped_lock lock(printing);
    err << fmt::format("  figure 5: exact rendering {} of {}\n", ++done, options.rolls)
        << std::flush;
    return differences;
  });

  const std::vector<std::string> names = {"octree", "importance", "priority"};
  std::vector<std::vector<Difference>> differences(names.size() * sizes.size());
  for_each_index(differences.size(), [&](std::size_t i) {
    // The longest first.
    const std::size_t name = i % names.size(), size = sizes.size() - 1 - i / names.size();
    differences[name * sizes.size() + size] = difference_of(names[name], sizes[size], 0);
  });
  ReportTable table{"figure_5",
                    "Each measure: difference relative to chance (95th percentile)",
                    {"strategy", "measure", "k", "difference", "chance_95", "ratio"},
                    {},
                    true};
  ReportTable summary{"figure_5_summary",
                      "Measures beyond chance",
                      {"strategy", "k", "beyond", "of", "typical_ratio", "beyond_which"},
                      {}};
  for (std::size_t i = 0; i < differences.size(); ++i)
    add_rows(names[i / sizes.size()], sizes[i % sizes.size()], differences[i], chance, table,
             summary);
  report_perception(std::move(summary), std::move(table), sizes, options.rolls, report);
}

}  // namespace clamor
