// experiment_stadium.cpp: the paper's figures 4 and 5: error of a sample's sound against that of
// all sources.
#include <algorithm>
#include <cmath>
#include <map>
#include <ostream>

#include <fmt/format.h>

#include "tools/experiments/experiment_scene.h"
#include "tools/experiments/experiments.h"

namespace clamor {

namespace {

// Mean errors of renderings with several seeds. More seeds for small k, whose results scatter more
// and cost less.
std::vector<ReportTable::Cell> rendered(const ExperimentScene& scene, const Vec3& place,
                                        double seconds, const std::string& strategy, std::size_t k,
                                        const Sound& all) {
  const double whole = energy(all);
  const std::size_t count = std::clamp<std::size_t>(1024 / k, 1, 4);
  const auto share = 1.0 / static_cast<double>(count);
  double loudness_db = 0, l2 = 0, renormalised_l2 = 0;
  for (std::size_t seed = 1; seed <= count; ++seed) {
    const SeededSampler sampler = scene.sampler(strategy, k, estimator_of(strategy), seed);
    const Sound sound = scene.render(*sampler.sampler, place, seconds);
    const double power = energy(sound) / whole, product = inner_product(sound, all) / whole;
    loudness_db += share * 10 * std::log10(power);
    l2 += share * std::sqrt(std::max(0.0, 1 - 2 * product + power));
    renormalised_l2 += share * std::sqrt(std::max(0.0, 2 - 2 * product / std::sqrt(power)));
  }
  return {strategy, name_of(estimator_of(strategy)), k, loudness_db, l2, renormalised_l2};
}

// Figure 4.
void waveform_error(const ExperimentScene& scene, const Vec3& place, double seconds,
                    const Sound& all, const std::vector<std::size_t>& sizes, ReportPage& report,
                    std::ostream& err) {
  ReportTable table{"figure_4",
                    "Waveform error and level, rendered",
                    {"strategy", "estimator", "k", "loudness_db", "l2", "renormalised_l2"},
                    {}};
  std::vector<std::string> names;
  for (const StrategyInfo& info : kStrategies)
    if (info.name != std::string("all")) names.emplace_back(info.name);
  table.rows.resize(names.size() * sizes.size());
  for_each_index(table.rows.size(), [&](std::size_t i) {
    // The longest first.
    const std::size_t name = i % names.size(), size = sizes.size() - 1 - i / names.size();
    table.rows[name * sizes.size() + size] =
        rendered(scene, place, seconds, names[name], sizes[size], all);
  });
  err << "  figure 4 is done" << std::endl;

  const std::vector<double> ticks(sizes.begin(), sizes.end());
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
  plot(absolute, table, "k", "l2");
  plot(relative, table, "k", "renormalised_l2");
  plot(loudness, table, "k", "loudness_db");
  // Through the first point of the octree, the paper's own strategy.
  const double first = column_of(table, "l2", "octree").front();
  plot_curve(absolute, "k^-1/2", ticks,
             [&](double k) { return first * std::sqrt(ticks.front() / k); });

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

}  // namespace

std::string figure_4_text(const ReportTable& table) {
  struct LevelError {
    double db = 0, k = 0;
    std::string strategy;
  };
  LevelError ours, theirs;  // the largest ones
  std::map<std::size_t, double> our_error, best_of_paper;
  for (const std::string& strategy : names_of(table)) {
    const auto k_of = column_of(table, "k", strategy),
               level_db = column_of(table, "loudness_db", strategy),
               error = column_of(table, "renormalised_l2", strategy);
    LevelError& largest = strategy == "priority" ? ours : theirs;
    for (std::size_t i = 0; i < k_of.size(); ++i) {
      if (std::abs(level_db[i]) >= std::abs(largest.db)) largest = {level_db[i], k_of[i], strategy};
      const auto k = static_cast<std::size_t>(k_of[i]);
      auto& errors = strategy == "priority" ? our_error : best_of_paper;
      errors[k] = std::min(errors.try_emplace(k, error[i]).first->second, error[i]);
    }
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
  const auto opened = options.open_scene();
  if (!opened.ok()) return opened.error();
  const ExperimentScene& scene = **opened;
  const Vec3 place = options.place_in(scene);
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
  const SeededSampler everything = scene.sampler("all", 1);
  const Sound all = scene.render(*everything.sampler, place, heard_s);
  if (energy(all) == 0)
    return Error("nothing is heard at the listener's place; name another with --listener.")
        .in(options.level);
  Sound begin = all;
  for (auto& channel : begin.channels)
    channel.resize(static_cast<std::size_t>(options.seconds * kSampleRate_hz));
  waveform_error(scene, place, options.seconds, begin, sizes, report, err);
  perception(scene, options, heard_s, all, sizes, report, err);
  return report;
}

}  // namespace clamor
