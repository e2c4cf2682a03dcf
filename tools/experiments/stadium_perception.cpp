#include "tools/experiments/stadium_perception.h"

#include <algorithm>
#include <cmath>
#include <mutex>
#include <ostream>

#include <fmt/format.h>

#include "tools/analysis/null_distribution.h"
#include "tools/analysis/sound_comparison.h"

namespace clamor {

namespace {

// Scales a sound to the energy of `like`.
Sound brought_to(const Sound& like, Sound sound) {
  const auto gain = static_cast<float>(std::sqrt(energy(like) / energy(sound)));
  for (auto& channel : sound.channels)
    for (float& sample : channel) sample *= gain;
  return sound;
}

// Differences between the original and exact renderings with other phases.
NullDistribution chance_of_phases(const ExperimentScene& scene, const Walk& here, double seconds,
                                  const Sound& all, const SoundAnalysis& original, int rolls,
                                  std::ostream& err) {
  int done = 0;
  std::mutex printing;
  return null_distribution(rolls, [&](std::uint32_t roll) {
    SeededSampler sampler = scene.sampler("all", 1, Estimator::kPower, 1);
    const Sound other = scene.render(*sampler.sampler, here, seconds, 1000 + roll);
    auto differences = compare(original, analyse(brought_to(all, other), SoundKind::kProgramme));
    const std::scoped_lock lock(printing);
    err << fmt::format("  figure 5: exact rendering {} of {}\n", ++done, rolls) << std::flush;
    return differences;
  });
}

// Waveform measures depend on inaudible phases, so they do not count.
bool counts(const Difference& difference) {
  switch (difference.info->measure) {
    case Measure::kL2:
    case Measure::kRenormalisedL2:
    case Measure::kCorrelation:
      return false;
    default:
      return difference.worst() != nullptr;
  }
}

// Measures of one sample against the null distribution.
struct BeyondChance {
  int beyond = 0, taken = 0;
  double logs = 0;    // of the ratios to the 95th percentile of chance
  std::string which;  // keys of the measures beyond chance

  double percent() const { return 100.0 * beyond / std::max(taken, 1); }
  double typical_ratio() const { return std::exp(logs / std::max(taken, 1)); }
};

// Also adds a row per measure to the table.
BeyondChance beyond_chance(const SamplingChoice& choice, const std::vector<Difference>& differences,
                           const NullDistribution& chance, ReportTable& table) {
  BeyondChance result;
  for (const Difference& difference : differences) {
    if (!counts(difference)) continue;
    const double size = difference.size();
    const double by_chance = chance.size_95(difference.info->measure);
    if (size == 0 && by_chance == 0) continue;
    ++result.taken;
    const double ratio = std::clamp(size / std::max(by_chance, 1e-9), 0.01, 100.0);
    result.logs += std::log(ratio);
    if (size > by_chance) {
      ++result.beyond;
      result.which += (result.which.empty() ? "" : "; ") + std::string(difference.info->key);
    }
    table.rows.push_back({choice.strategy, difference.info->key, static_cast<double>(choice.k),
                          size, by_chance, ratio});
  }
  return result;
}

void report_perception(const std::vector<SamplingChoice>& kinds,
                       const std::vector<SamplingChoice>& choices,
                       const std::vector<std::vector<Difference>>& differences,
                       const NullDistribution& chance, const std::vector<std::size_t>& sizes,
                       int rolls, ReportPage& report) {
  std::vector<double> ticks(sizes.begin(), sizes.end());
  Chart share{.title = "Figure 5: measures that tell the sample from an exact rendering",
              .x_label = "k, sources mixed",
              .y_label = "measures beyond chance (%)",
              .log_x = true,
              .x_ticks = ticks,
              .y_range = {{0, 100}}};
  share.zones = {
      {32, 181, "paper: bad"}, {1448, 4096, "satisfactory"}, {6000, 32768, "very close"}};
  Chart typical{.title = "Figure 5: distance beyond chance, geometric mean of the measures",
                .x_label = "k, sources mixed",
                .y_label = "difference / 95th percentile of chance",
                .log_x = true,
                .log_y = true,
                .x_ticks = ticks};
  ReportTable table{"figure_5",
                    "Each measure: difference relative to chance (95th percentile)",
                    {"strategy", "measure", "k", "difference", "chance_95", "ratio"},
                    {},
                    true};
  ReportTable summary{"figure_5_summary", "Measures beyond chance", {}, {}, false};
  summary.columns = {"strategy", "k", "beyond", "of", "typical_ratio", "beyond_which"};
  for (const SamplingChoice& kind : kinds) {
    Chart::Series of_share{.name = kind.strategy, .colour = colour_of(kind.strategy)};
    Chart::Series of_typical = of_share;
    for (std::size_t w = choices.size(); w-- > 0;) {
      if (choices[w].strategy != kind.strategy) continue;
      const BeyondChance result = beyond_chance(choices[w], differences[w], chance, table);
      const auto k = static_cast<double>(choices[w].k);
      of_share.points.emplace_back(k, result.percent());
      of_typical.points.emplace_back(k, result.typical_ratio());
      summary.rows.push_back({choices[w].strategy, k, static_cast<double>(result.beyond),
                              static_cast<double>(result.taken), result.typical_ratio(),
                              result.which});
    }
    share.series.push_back(of_share);
    typical.series.push_back(of_typical);
  }
  Chart::Series one{"chance", {}, Chart::Series::Look::kDashes, Chart::kGrey};
  Chart::Series five{"chance", {}, Chart::Series::Look::kDashes, Chart::kGrey};
  for (const std::size_t k : {sizes.front(), sizes.back()}) {
    one.points.emplace_back(static_cast<double>(k), 1);
    five.points.emplace_back(static_cast<double>(k), 5);
  }
  typical.series.push_back(one);
  share.series.push_back(five);

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

void perception(const ExperimentScene& scene, const Walk& here, double seconds, const Sound& all,
                const std::vector<std::size_t>& sizes, int rolls, ReportPage& report,
                std::ostream& err) {
  const SoundAnalysis original = analyse(all, SoundKind::kProgramme);
  const NullDistribution chance = chance_of_phases(scene, here, seconds, all, original, rolls, err);
  const std::vector<SamplingChoice> kinds = {{"octree", Estimator::kAmplitude, 0},
                                             {"importance", Estimator::kAmplitude, 0},
                                             {"priority", Estimator::kPower, 0}};
  std::vector<SamplingChoice> choices;
  for (auto k = sizes.rbegin(); k != sizes.rend(); ++k)
    for (SamplingChoice choice : kinds) {
      choice.k = *k;
      choices.push_back(choice);
    }
  std::vector<std::vector<Difference>> differences(choices.size());
  for_each_index(choices.size(), [&](std::size_t w) {
    SeededSampler sampler =
        scene.sampler(choices[w].strategy, choices[w].k, choices[w].estimator, 1);
    const Sound sound = brought_to(all, scene.render(*sampler.sampler, here, seconds));
    differences[w] = compare(original, analyse(sound, SoundKind::kProgramme));
  });
  report_perception(kinds, choices, differences, chance, sizes, rolls, report);
}

}  // namespace clamor
