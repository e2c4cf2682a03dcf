// experiment_walk.cpp: share of the sample exchanged per metre of a walk, and loudness meanwhile.
//
// Only powers are computed. A source counts as exchanged when it is in the sample of a keyframe and
// was not in the previous one.
#include <algorithm>
#include <cmath>
#include <numeric>
#include <ostream>
#include <unordered_set>

#include <fmt/format.h>

#include "runtime/voices/keyframe.h"
#include "tools/experiments/experiment_scene.h"
#include "tools/experiments/experiments.h"

namespace clamor {

namespace {

struct Walked {
  double exchanged_per_m = 0, exchanged_per_s = 0;  // shares of the sample
  double due_per_m = 0;  // weight changes of a chosen source, in factors of epsilon
  std::vector<std::pair<double, double>> loudness_error_db;  // over metres
  double rms_db = 0, worst_db = 0;
};

// Change of a weight in factors of epsilon, up or down; a change to or from zero counts as one.
double factors_between(double before, double now) {
  static const double kEpsilon_nepers = std::log(StrategyTuning{}.epsilon);
  if (before == now) return 0;
  return before > 0 && now > 0 ? std::abs(std::log(now / before)) / kEpsilon_nepers : 1;
}

// `powers` are shared by all strategies, because they are the most expensive part.
Walked walked(const ExperimentScene& scene, const std::string& strategy, std::size_t k,
              const std::vector<Vec3>& places, const std::vector<std::vector<double>>& powers) {
  SeededSampler sampler = scene.sampler(strategy, k);
  Walked result;
  std::unordered_set<std::uint64_t> last;
  double exchanged = 0, squares = 0, due = 0;
  const double step_m = length(places[1] - places[0]);
  for (std::size_t p = 0; p < places.size(); ++p) {
    std::unordered_set<std::uint64_t> now;
    double power = 0;
    for (const SampledSource& chosen : sampler.sample(places[p])) {
      now.insert(chosen.number);
      power += chosen.power_scale * powers[p][chosen.number];
      exchanged += p > 0 && !last.contains(chosen.number);
    }
    if (p > 0)
      for (const std::uint64_t number : last)
        due += factors_between(powers[p - 1][number], powers[p][number]);
    last = std::move(now);
    const double whole = std::accumulate(powers[p].begin(), powers[p].end(), 0.0);
    const double error_db = 10 * std::log10(power / whole);
    result.loudness_error_db.emplace_back(step_m * static_cast<double>(p), error_db);
    squares += error_db * error_db;
    result.worst_db = std::max(result.worst_db, std::abs(error_db));
  }
  const double steps = static_cast<double>(places.size() - 1);
  result.rms_db = std::sqrt(squares / static_cast<double>(places.size()));
  result.exchanged_per_m = exchanged / static_cast<double>(k) / (steps * step_m);
  result.due_per_m = due / static_cast<double>(k) / (steps * step_m);
  result.exchanged_per_s = exchanged / static_cast<double>(k) / (steps * kKeyframe_s);
  return result;
}

// A circle, so that the listener stays inside the level: several rounds at 30 m/s.
std::vector<Vec3> circle(const Vec3& start, double speed_mps, std::size_t keyframes) {
  std::vector<Vec3> places;
  const double radius_m = 1.5 * 5 / 2 / 3.14159;
  for (std::size_t i = 0; i < keyframes; ++i) {
    const double angle = speed_mps * kKeyframe_s * static_cast<double>(i) / radius_m;
    places.push_back(start + radius_m * Vec3(1 - std::cos(angle), 0, std::sin(angle)));
  }
  return places;
}

void write_figures(ReportTable walk, ReportTable due, const Chart& loudness, ReportPage& report) {
  report.claim(
      "Full resampling turns the static error into noise; stochastic diffusion exchanges at most "
      "q = 20 % per second, whether anything has changed or not; adaptive diffusion adapts the "
      "rate of change to the changes of the weights (3.4).",
      walk_text(walk));
  Chart exchange{.title = "Sample exchanged per metre",
                 .x_label = "speed (m/s)",
                 .y_label = "share of the sample (% per m)",
                 .log_x = true,
                 .log_y = true,
                 .x_ticks = {1.5, 5, 30}};
  const auto still = plot(exchange, walk, "speed_mps", "exchanged_percent_per_m", 0);
  report.chart(exchange, "Sources of the sample that the keyframe before did not have." +
                             left_out_text(still, "exchanged none"));
  report.chart(loudness,
               "Power of the sample over that of all sources, --estimator power. importance and "
               "random are drawn for the first place and keep their factors.");
  report.table(std::move(walk));
  report.paragraph(fmt::format(
      "Adaptive diffusion exchanges a source when its weight has fallen by the factor epsilon, "
      "{}, since it was chosen, and another when one has risen as much. So of every hundred "
      "chosen it exchanges as many per metre as their weights change by such factors, or fewer: "
      "those that come begin anew. A source r metres away changes by up to 2 / (r ln epsilon) of "
      "them a metre by its distance alone; lobes add to it. At the three speeds the rule asked "
      "for {} % per metre, and {} % were exchanged.",
      StrategyTuning{}.epsilon, range_text(column_of(due, "due_percent_per_m"), 1),
      range_text(column_of(due, "exchanged_percent_per_m"), 1)));
  report.table(std::move(due));
}

}  // namespace

std::string walk_text(const ReportTable& table) {
  const auto of = [&](const char* column, const char* strategy) {
    return range_text(column_of(table, column, strategy), 1);
  };
  return fmt::format(
      "At {} m/s, full resampling exchanged {} % of its sample per second and stochastic diffusion "
      "{} %; adaptive diffusion exchanged {} % per metre and priority, which has neither q nor "
      "epsilon, {} %. The power of priority's sample was up to {} dB off that of all sources.",
      range_text(column_of(table, "speed_mps"), 1),
      of("exchanged_percent_per_s", "full-resampling"),
      of("exchanged_percent_per_s", "stochastic-diffusion"),
      of("exchanged_percent_per_m", "adaptive-diffusion"),
      of("exchanged_percent_per_m", "priority"),
      fmt::format("{:.2f}", quantile(column_of(table, "loudness_worst_db", "priority"), 1)));
}

Result<ReportPage> walk_experiment(const ExperimentOptions& options, std::ostream& err) {
  const auto opened = options.open_scene();
  if (!opened.ok()) return opened.error();
  const ExperimentScene& scene = **opened;
  const Vec3 start = options.place_in(scene);
  const std::size_t keyframes = options.quick ? 20 : 100;  // 2 s
  const std::size_t k = std::min<std::size_t>(2000, scene.size() / 4);
  ReportPage report(
      "walk", "A walk: what is exchanged, and how loud it is meanwhile",
      fmt::format("The bake {}: {} sources, k = {}; {:.1f} s from {:.1f}, {:.1f}, {:.1f} m, "
                  "50 keyframes a second",
                  options.level, scene.size(), k, static_cast<double>(keyframes) * kKeyframe_s,
                  start.x, start.y, start.z));
  ReportTable walk{"walk",
                   "Walking, running, flying",
                   {"strategy", "speed_mps", "exchanged_percent_per_m", "exchanged_percent_per_s",
                    "loudness_rms_db", "loudness_worst_db"},
                   {}};
  ReportTable due{"adaptive",
                  "Adaptive diffusion: exchanged, and at most due",
                  {"speed_mps", "exchanged_percent_per_m", "due_percent_per_m"},
                  {}};
  Chart loudness{.title = "Loudness along a walk at 1.5 m/s, relative to all sources",
                 .x_label = "way (m)",
                 .y_label = "error (dB)"};
  for (const double speed_mps : {1.5, 5.0, 30.0}) {
    err << fmt::format("  {} m/s", speed_mps) << std::endl;
    const std::vector<Vec3> places = circle(start, speed_mps, keyframes);
    std::vector<std::vector<double>> powers(keyframes);
    for_each_index(keyframes, [&](std::size_t i) { powers[i] = scene.powers(places[i]); });
    std::vector<Walked> results(kStrategies.size());
    for_each_index(results.size(), [&](std::size_t s) {
      if (const std::string name = kStrategies[s].name; name != "all")
        results[s] = walked(scene, name, k, places, powers);
    });
    for (std::size_t s = 0; s < results.size(); ++s) {
      const Walked& result = results[s];
      const std::string name = kStrategies[s].name;
      if (name == "all") continue;
      walk.rows.push_back({name, speed_mps, 100 * result.exchanged_per_m,
                           100 * result.exchanged_per_s, result.rms_db, result.worst_db});
      if (name == "adaptive-diffusion")
        due.rows.push_back({speed_mps, 100 * result.exchanged_per_m, 100 * result.due_per_m});
      if (speed_mps == 1.5)
        loudness.series.push_back(
            {name, result.loudness_error_db, Chart::Series::Look::kLine, colour_of(name)});
    }
  }
  write_figures(std::move(walk), std::move(due), loudness, report);
  return report;
}

}  // namespace clamor
