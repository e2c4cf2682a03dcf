// experiment_stadium.cpp: the paper's figures 4 and 5: error of a sample's sound against that of
// all sources.
#include <algorithm>
#include <cmath>
#include <map>
#include <ostream>

#include <fmt/format.h>

#include "tools/analysis/null_distribution.h"
#include "tools/analysis/sound_comparison.h"
#include "tools/experiments/experiments.h"
#include "tools/experiments/stadium_perception.h"

namespace clamor {

namespace {

struct RenderOutcome {
  double loudness_db = 0, l2 = 0, renormalised_l2 = 0;
};

// More seeds for small k, whose results scatter more and cost less.
std::size_t drawings(std::size_t k) { return std::clamp<std::size_t>(1024 / k, 1, 4); }

RenderOutcome rendered(const ExperimentScene& scene, const Walk& here, double seconds,
                       const SamplingChoice& choice, const Sound& all) {
  RenderOutcome outcome;
  const double whole = energy(all);
  const std::size_t count = drawings(choice.k);
  for (std::size_t seed = 1; seed <= count; ++seed) {
    SeededSampler sampler = scene.sampler(choice.strategy, choice.k, choice.estimator, seed);
    const Sound sound = scene.render(*sampler.sampler, here, seconds);
    const double power = energy(sound) / whole, product = inner_product(sound, all) / whole;
    const auto share = 1.0 / static_cast<double>(count);
    outcome.loudness_db += share * 10 * std::log10(power);
    outcome.l2 += share * std::sqrt(std::max(0.0, 1 - 2 * product + power));
    outcome.renormalised_l2 += share * std::sqrt(std::max(0.0, 2 - 2 * product / std::sqrt(power)));
  }
  return outcome;
}

void report_waveform_error(const std::vector<SamplingChoice>& choices,
                           const std::vector<RenderOutcome>& outcomes, double seconds,
                           const std::vector<std::size_t>& sizes, ReportPage& report) {
  std::vector<double> ticks(sizes.begin(), sizes.end());
  Chart absolute{.title = "Figure 4: absolute L2 error",
                 .x_label = "k, sources mixed",
                 .y_label = "|X - f| / |f|",
                 .log_x = true,
                 .log_y = true,
                 .x_ticks = ticks};
  Chart relative{.title = "Figure 4: renormalised L2 error (the paper's red curve)",
                 .x_label = "k, sources mixed",
                 .y_label = "|X / |X| - f / |f||",
                 .log_x = true,
                 .x_ticks = ticks};
  Chart loudness{.title = "Level error",
                 .x_label = "k, sources mixed",
                 .y_label = "RMS level re all sources (dB)",
                 .log_x = true,
                 .x_ticks = ticks};
  ReportTable table{"figure_4", "Waveform error and level, rendered", {}, {}, false};
  table.columns = {"strategy", "estimator", "k", "loudness_db", "l2", "renormalised_l2"};
  for (const StrategyInfo& info : kStrategies) {
    Chart::Series of_absolute{.name = info.name, .colour = colour_of(info.name)};
    Chart::Series of_relative = of_absolute, of_loudness = of_absolute;
    for (std::size_t w = choices.size(); w-- > 0;) {  // in order of ascending k
      if (choices[w].strategy != info.name) continue;
      const auto k = static_cast<double>(choices[w].k);
      const RenderOutcome& outcome = outcomes[w];
      const bool power = choices[w].estimator == Estimator::kPower;
      table.rows.push_back({choices[w].strategy, power ? "power" : "amplitude", k,
                            outcome.loudness_db, outcome.l2, outcome.renormalised_l2});
      of_absolute.points.emplace_back(k, outcome.l2);
      of_relative.points.emplace_back(k, outcome.renormalised_l2);
      of_loudness.points.emplace_back(k, outcome.loudness_db);
    }
    if (of_absolute.points.empty()) continue;
    absolute.series.push_back(of_absolute);
    relative.series.push_back(of_relative);
    loudness.series.push_back(of_loudness);
  }
  // k^-1/2 through the first point of the octree, the paper's own strategy.
  Chart::Series slope{"k^-1/2", {}, Chart::Series::Look::kDashes, Chart::kGrey};
  for (const SamplingChoice& choice : choices)
    if (choice.strategy == "octree" && choice.k == sizes.front())
      for (const std::size_t k : sizes)
        slope.points.emplace_back(
            static_cast<double>(k),
            outcomes[static_cast<std::size_t>(&choice - choices.data())].l2 *
                std::sqrt(static_cast<double>(sizes.front()) / static_cast<double>(k)));
  absolute.series.push_back(slope);

  report.heading("Figure 4: the waveform's error");
  report.claim(
      "\"The absolute l2-error decreases with O(k^-1/2) for k sample sources, as predicted.\" Much "
      "of that is amplitude. \"The relative error (i.e. comparing renormalized results) does not "
      "converge according to the central limit theorem, thus yielding worse results.\" (5.1)",
      figure_4_text(table));
  report.charts(
      {absolute, relative, loudness}, 1,
      fmt::format("The paper's strategies with --estimator amplitude, priority with power. "
                  "{:.1f} s rendered by the player's mixer, both ears; up to 4 drawings "
                  "per point. A renormalised error of 1.41 is that of an unrelated "
                  "sound.",
                  seconds));
  report.table(std::move(table));
}

// Figure 4.
void waveform_error(const ExperimentScene& scene, const Walk& here, double seconds,
                    const Sound& all, const std::vector<std::size_t>& sizes, ReportPage& report,
                    std::ostream& err) {
  std::vector<SamplingChoice> choices;
  for (auto k = sizes.rbegin(); k != sizes.rend(); ++k)  // the longest jobs first
    for (const StrategyInfo& info : kStrategies)
      if (const std::string name = info.name; name != "all")
        choices.push_back(
            {name, name == "priority" ? Estimator::kPower : Estimator::kAmplitude, *k});
  std::vector<RenderOutcome> outcomes(choices.size());
  for_each_index(choices.size(), [&](std::size_t w) {
    outcomes[w] = rendered(scene, here, seconds, choices[w], all);
  });
  report_waveform_error(choices, outcomes, seconds, sizes, report);
  err << "  figure 4 is done" << std::endl;
}

}  // namespace

std::string figure_4_text(const ReportTable& table) {
  struct LevelError {
    double db = 0, k = 0;
    std::string strategy;
  };
  LevelError ours, theirs;  // the largest ones
  std::map<std::size_t, double> our_error, best_of_paper;
  const auto k_of = column_of(table, "k"), level_db = column_of(table, "loudness_db"),
             error = column_of(table, "renormalised_l2");
  for (std::size_t i = 0; i < table.rows.size(); ++i) {
    const std::string& strategy = std::get<std::string>(table.rows[i][0]);
    LevelError& largest = strategy == "priority" ? ours : theirs;
    if (std::abs(level_db[i]) >= std::abs(largest.db)) largest = {level_db[i], k_of[i], strategy};
    const auto k = static_cast<std::size_t>(k_of[i]);
    if (strategy == "priority")
      our_error[k] = error[i];
    else if (!best_of_paper.contains(k) || best_of_paper[k] > error[i])
      best_of_paper[k] = error[i];
  }

  std::string text;
  const auto sizes = column_of(table, "k", "octree");
  const auto absolute = fitted_exponent(sizes, column_of(table, "l2", "octree"));
  const auto relative = fitted_exponent(sizes, column_of(table, "renormalised_l2", "octree"));
  if (absolute && relative)
    text += fmt::format(
        "From k = {} to {}, the octree's absolute error goes as k^{:.2f} and its renormalised "
        "error as k^{:.2f}. ",
        sizes.front(), sizes.back(), *absolute, *relative);
  text += fmt::format(
      "Priority, which scales powers, is up to {:.2f} dB off the level of all sources ({:+.2f} dB "
      "at k = {}); the paper's strategies are up to {:.2f} dB off ({:+.2f} dB, {} at k = {}).",
      std::abs(ours.db), ours.db, ours.k, std::abs(theirs.db), theirs.db, theirs.strategy,
      theirs.k);
  std::vector<WorseThanPaper> worse;
  std::size_t compared = 0;
  for (const auto& [k, of_priority] : our_error) {
    if (k < 128 || !best_of_paper.contains(k)) continue;
    ++compared;
    if (of_priority > best_of_paper[k]) worse.push_back({k, of_priority, best_of_paper[k]});
  }
  if (compared == 0) return text;
  text += " From k = 128 up, its renormalised error is ";
  return text + (worse.size() == compared ? "nowhere below the best of the paper's strategies."
                                          : "below the best of the paper's strategies " +
                                                at_every_k_except(worse) + ".");
}

Result<ReportPage> stadium_experiment(const ExperimentOptions& options, std::ostream& err) {
  const auto opened = ExperimentScene::open(options.level, options.quick ? kQuickSources : 0);
  if (!opened.ok()) return opened.error();
  const ExperimentScene& scene = **opened;
  const Vec3 place = options.listener_m.value_or(scene.default_listener_m());
  const Walk here = Walk::standing({place, 0, 0});
  ReportPage report(
      "stadium", "k of n sources, heard against all of them",
      fmt::format("The bake {}: {} sources ({} emitters), {} signals; listener at {:.1f}, {:.1f}, "
                  "{:.1f} m. The "
                  "paper: 36 416 sources (16 416 fans, 20 000 reflections), 13 signals.",
                  options.level, scene.size(), scene.input().emitters.size(),
                  scene.input().signals.size(), place.x, place.y, place.z));
  const auto sizes = sample_sizes(scene, options.quick ? 128 : 16384);
  if (sizes.empty())
    return Error("has too few sources to choose from; bake it with more --sources.")
        .in(options.level);
  // Texture statistics need at least 1.5 s.
  const double heard_s = std::max(options.seconds, 1.6);
  SeededSampler everything = scene.sampler("all", 1, Estimator::kPower, 1);
  const Sound all = scene.render(*everything.sampler, here, heard_s);
  if (energy(all) == 0)
    return Error("nothing is heard at the listener's place; name another with --listener.")
        .in(options.level);
  Sound begin = all;
  for (auto& channel : begin.channels)
    channel.resize(static_cast<std::size_t>(options.seconds * kSampleRate_hz));
  waveform_error(scene, here, options.seconds, begin, sizes, report, err);
  perception(scene, here, heard_s, all, sizes, options.rolls, report, err);
  return report;
}

}  // namespace clamor
