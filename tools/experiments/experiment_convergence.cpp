// experiment_convergence.cpp: loudness and waveform error against k, and the time a keyframe takes.
//
// Nothing is rendered: sounds are assumed to be incoherent, so powers add, and each sample gives
// one number. With A_i the amplitude of source i and S_i its factor (0 if not chosen),
//
//   loudness   sum S_i^2 A_i^2 / sum A_i^2
//   L2         |X - f| / |f| = sqrt(sum (S_i - 1)^2 A_i^2 / sum A_i^2)
#include <algorithm>
#include <cmath>
#include <numeric>
#include <ostream>

#include <fmt/format.h>

#include "common/cpu_time.h"
#include "tools/experiments/baked_level.h"
#include "tools/experiments/experiment_scene.h"
#include "tools/experiments/experiments.h"

namespace clamor {

namespace {

struct Outcome {
  double loudness_db = 0;   // of the mean power, relative to all sources
  double deviation_db = 0;  // standard deviation over the seeds
  double beyond_95_db = 0;  // 95th percentile of the absolute error
  double l2 = 0, renormalised_l2 = 0;
};

Outcome drawn(const ExperimentScene& scene, const std::string& strategy, std::size_t k,
              Estimator estimator, const Vec3& place, const std::vector<double>& powers,
              int seeds) {
  const double whole = std::accumulate(powers.begin(), powers.end(), 0.0);
  std::vector<double> loudness(static_cast<std::size_t>(seeds)), l2 = loudness, relative = loudness;
  for_each_index(static_cast<std::size_t>(seeds), [&](std::size_t i) {
    auto sampler = scene.sampler(strategy, k, estimator, 2 + i);
    double power = 0, product = 0;
    for (const SampledSource& chosen : sampler.sample(place)) {
      const double of_source = powers[chosen.number] / whole;
      power += chosen.power_scale * of_source;
      product += std::sqrt(chosen.power_scale) * of_source;
    }
    loudness[i] = power;
    l2[i] = std::sqrt(std::max(0.0, 1 - 2 * product + power));
    relative[i] = std::sqrt(std::max(0.0, 2 - 2 * product / std::sqrt(power)));
  });
  Outcome outcome;
  outcome.loudness_db = 10 * std::log10(mean_of(loudness));
  std::vector<double> off_db;
  double squares = 0;
  for (const double power : loudness) {
    const double db = 10 * std::log10(power);
    squares += (db - outcome.loudness_db) * (db - outcome.loudness_db);
    off_db.push_back(std::abs(db));
  }
  std::sort(off_db.begin(), off_db.end());
  outcome.deviation_db = std::sqrt(squares / seeds);
  outcome.beyond_95_db = off_db[static_cast<std::size_t>(std::ceil(0.95 * seeds)) - 1];
  outcome.l2 = mean_of(l2);
  outcome.renormalised_l2 = mean_of(relative);
  return outcome;
}

// Median CPU time of sample() for a walking listener, over one second of keyframes.
double sample_ms(Sampler& sampler, const Vec3& place) {
  std::vector<double> took_ms;
  for (int keyframe = 0; keyframe < 25; ++keyframe) {
    const Vec3 here = place + Vec3(0.03 * keyframe, 0, 0.01 * keyframe);
    const double start_s = process_time_s();  // as other programs may run
    sampler.sample(here);
    if (keyframe > 0) took_ms.push_back(1e3 * (process_time_s() - start_s));
  }
  std::nth_element(took_ms.begin(), took_ms.begin() + 12, took_ms.end());
  return took_ms[12];
}

std::string error_in_words(const ReportTable& table) {
  const ReportTable rows = rows_with(table, "estimator", "amplitude");
  std::vector<double> exponents;
  for (const std::string& name : names_of(rows))
    if (const auto exponent =
            fitted_exponent(column_of(rows, "k", name), column_of(rows, "l2", name)))
      exponents.push_back(*exponent);
  std::string text;
  if (!exponents.empty())
    text = fmt::format("Fitted over all k, the exponent is {}, by strategy (dashed: -1/2). ",
                       range_text(exponents, 2));
  const auto ours = column_of(table, "l2", "priority");
  return text + fmt::format("Priority's error is {}.", range_text(ours, 2));
}

// Says how the time grows from the fewest sources to the most.
std::string growth_in_words(const std::vector<Chart::Series>& by_n) {
  if (by_n.empty() || by_n[0].points.size() < 2) return "";
  std::vector<std::string> parts;
  for (const Chart::Series& series : by_n)
    parts.push_back(
        fmt::format("{} {:.1f} times", series.name,
                    series.points.back().second / std::max(series.points.front().second, 1e-6)));
  return fmt::format("With {:.0f} times the sources a keyframe takes {} as long. ",
                     by_n[0].points.back().first / by_n[0].points.front().first, listed(parts));
}

ReportTable loudness_table(const ExperimentScene& scene, const Vec3& place,
                           const std::vector<double>& powers, const std::vector<std::size_t>& sizes,
                           int seeds, std::ostream& err) {
  ReportTable table{"loudness",
                    "Every strategy and estimator",
                    {"strategy", "estimator", "k", "loudness_db", "deviation_db", "within_95_db",
                     "l2", "renormalised_l2"},
                    {},
                    true};
  for (const StrategyInfo& info : kStrategies) {
    const std::string name = info.name;
    if (name == "all") continue;
    err << "  " << name << std::endl;
    for (const Estimator estimator : {Estimator::kPower, Estimator::kAmplitude}) {
      if (name == "priority" && estimator != estimator_of(name)) continue;
      for (const std::size_t k : sizes) {
        const Outcome outcome = drawn(scene, name, k, estimator, place, powers, seeds);
        table.rows.push_back({name, name_of(estimator), k, outcome.loudness_db,
                              outcome.deviation_db, outcome.beyond_95_db, outcome.l2,
                              outcome.renormalised_l2});
      }
    }
  }
  return table;
}

void loudness_and_error(const ExperimentScene& scene, const Vec3& place, bool quick, int seeds,
                        ReportPage& report, std::ostream& err) {
  const std::vector<double> powers = scene.powers(place);
  double amplitudes = 0, whole = 0;
  for (const double power : powers) {
    amplitudes += std::sqrt(power);
    whole += power;
  }
  const double effective = amplitudes * amplitudes / whole;
  const auto sizes = sample_sizes(scene, quick ? 256 : 16384);
  ReportTable table = loudness_table(scene, place, powers, sizes, seeds, err);
  const std::vector<double> ks(sizes.begin(), sizes.end());
  Chart loudness{.title = "Loudness against k, relative to all sources",
                 .x_label = "k, sources mixed",
                 .y_label = "mean loudness error (dB)",
                 .log_x = true,
                 .x_ticks = ks};
  Chart spread{.title = "Spread of loudness over seeds, power estimator",
               .x_label = "k, sources mixed",
               .y_label = "standard deviation (dB)",
               .log_x = true,
               .log_y = true,
               .x_ticks = ks};
  Chart error{.title = "Relative L2 error of the waveform, amplitude estimator",
              .x_label = "k, sources mixed",
              .y_label = "|X - f| / |f|",
              .log_x = true,
              .log_y = true,
              .x_ticks = ks};
  ReportTable own = table;  // with the estimator of each strategy
  std::erase_if(own.rows, [](const auto& row) {
    return row[1] != ReportTable::Cell(name_of(estimator_of(std::get<std::string>(row[0]))));
  });
  plot(loudness, own, "k", "loudness_db");
  plot(error, own, "k", "l2");
  // Smaller values are rounding errors.
  const auto unscattered =
      plot(spread, rows_with(table, "estimator", "power"), "k", "deviation_db", 1e-6);
  plot_curve(loudness, "1 + N_eff / k", ks,
             [&](double k) { return 10 * std::log10(1 + effective / k); });
  plot_curve(spread, "4.34 / sqrt(k - 1)", ks, [](double k) { return 4.34 / std::sqrt(k - 1); });
  plot_curve(error, "sqrt(N_eff / k)", ks, [&](double k) { return std::sqrt(effective / k); });

  report.heading("Loudness against k");
  report.claim(
      "Equation 3 scales amplitudes by 1 / (k p). \"The reduction of the l2-error corresponds "
      "mostly to a reduction of the amplitude of the mixing result\" (5.1): the fewer the sources, "
      "the louder; the authors renormalised by hand.",
      convergence_text(table) +
          fmt::format(" 10 log10(1 + N_eff / k), with N_eff = {:.0f} of {} sources, is dashed.",
                      effective, scene.size()));
  report.chart(loudness,
               fmt::format("Paper's strategies with --estimator amplitude, priority with power; "
                           "mean power of {} seeds each, for incoherent sounds.",
                           seeds));
  report.chart(spread,
               "Scatter of single samples with --estimator power. Dashed: the bound for "
               "priority sampling (Duffield, Lund, Thorup 2007)." +
                   left_out_text(unscattered, "scatter by less than 1e-6 dB"));
  report.heading("Error against k");
  report.claim(
      "The absolute l2-error decreases with O(k^-1/2) for k sample sources, as predicted "
      "(5.1). [Section 3.3 has n in place of k.]",
      error_in_words(table));
  report.chart(error, "Paper's strategies with --estimator amplitude, priority with power.");
  report.table(std::move(table));
}

Result<void> time_per_keyframe(const ExperimentOptions& options, const Vec3& place,
                               ReportPage& report, std::ostream& err) {
  const auto level = BakedLevel::open(options.level);
  if (!level.ok()) return level.error();
  ReportTable table{"time",
                    "Time to choose the sources of one keyframe, walking",
                    {"strategy", "n", "k", "phong_exponent", "ms"},
                    {}};
  const auto time = [&](const ExperimentScene& scene, const std::string& name, std::size_t k,
                        const std::string& exponent) {
    const auto sampler = scene.sampler(name, k);
    table.rows.push_back({name, scene.size(), k, exponent, sample_ms(*sampler.sampler, place)});
  };
  using Sizes = std::vector<std::size_t>;
  const Sizes counts = options.quick ? Sizes{1000} : Sizes{5000, 20000, 80000, 320000};
  const Sizes sizes = options.quick ? Sizes{150} : Sizes{150, 500, 2000, 8000};
  const std::size_t usual = options.quick ? 150 : 500, middle = counts[counts.size() / 2];
  std::size_t middle_size = 0;
  for (const std::size_t count : counts) {
    err << fmt::format("  {} sources", count) << std::endl;
    const auto scene = level->rebake(count);
    if (!scene.ok()) return scene.error();
    if (count == middle) middle_size = (*scene)->size();
    for (const char* const name :
         {"priority", "stochastic-diffusion", "adaptive-diffusion", "octree", "octree-diffusion"})
      for (const std::size_t k : sizes)
        if (k == usual || count == middle) time(**scene, name, k, "as baked");
  }
  Chart over_n{.title = "Time to choose k = 500 of n, walking",
               .x_label = "n, sources in the level",
               .y_label = "ms per keyframe, one core",
               .log_x = true,
               .log_y = true};
  Chart over_k{.title = "Time to choose k, walking",
               .x_label = "k, sources mixed",
               .y_label = "ms per keyframe, one core",
               .log_x = true,
               .log_y = true};
  plot(over_n, rows_with(table, "k", usual), "n", "ms");
  plot(over_k, rows_with(table, "n", middle_size), "k", "ms");
  for (const float exponent :
       options.quick ? std::vector<float>{20} : std::vector<float>{0, 20, 100}) {
    BakedLevel changed = *level;
    changed.set_phong(same_in_all_bands(exponent));
    const auto scene = changed.rebake(counts.back());
    if (!scene.ok()) return scene.error();
    for (const char* const name : {"priority", "octree", "octree-diffusion"})
      time(**scene, name, usual, fmt::format("{}", exponent));
  }
  report.heading("Time per keyframe");
  report.claim(
      "The running time does not depend on the number of sound sources but only on the ratio of "
      "visible and invisible sources and on the directionality of the sound emission (6). Dynamic "
      "sampling alone takes time in proportion to n at every keyframe (3.5).",
      growth_in_words(over_n.series) +
          "Priority is timed here on a list in memory; what plays walks the octree of the file, "
          "whose times are in tests/benchmarks/query_benchmark.cpp. Occlusion is off here.");
  report.charts({over_n, over_k}, 1, "Median of 24 keyframes, 1.6 m/s. Times are this machine's.");
  report.table(std::move(table));
  return {};
}

}  // namespace

std::string convergence_text(const ReportTable& table) {
  const ReportTable rows = rows_with(table, "estimator", "amplitude");
  const auto sizes = column_of(rows, "k");
  std::string text;
  if (!sizes.empty()) {
    const auto [low, high] = std::minmax_element(sizes.begin(), sizes.end());
    const auto at = [&](double k) {
      return range_text(column_of(rows_with(rows, "k", k), "loudness_db"), 2);
    };
    text = fmt::format(
        "Scaled on amplitudes, the paper's strategies are {} dB louder than all sources at k = {} "
        "and {} dB at k = {}. ",
        at(*low), *low, at(*high), *high);
  }
  double furthest_db = 0;
  for (const double db : column_of(table, "loudness_db", "priority"))
    furthest_db = std::max(furthest_db, std::abs(db));
  return text + fmt::format(
                    "The mean power of priority, which scales powers, is within {:.2f} dB "
                    "of that of all sources.",
                    furthest_db);
}

Result<ReportPage> convergence_experiment(const ExperimentOptions& options, std::ostream& err) {
  const auto scene = options.open_scene();
  if (!scene.ok()) return scene.error();
  const Vec3 place = options.place_in(**scene);
  const int seeds = options.quick ? 10 : options.seeds;
  ReportPage report(
      "convergence", "Convergence: error of k of n sources",
      fmt::format("The bake {}: {} sources; listener at {:.1f}, {:.1f}, {:.1f} m; {} seeds each",
                  options.level, (*scene)->size(), place.x, place.y, place.z, seeds));
  loudness_and_error(**scene, place, options.quick, seeds, report, err);
  if (const auto timed = time_per_keyframe(options, place, report, err); !timed.ok())
    return timed.error();
  return report;
}

}  // namespace clamor
