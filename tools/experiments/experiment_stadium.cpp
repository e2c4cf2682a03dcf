// experiment_stadium.cpp: the paper's figures 4 and 5: how far a sample's sound is from that of
// all.
#include <algorithm>
#include <cmath>
#include <map>
#include <mutex>
#include <ostream>

#include <fmt/format.h>

#include "runtime/measures/null_distribution.h"
#include "runtime/measures/sound_comparison.h"
#include "tools/experiments/experiments.h"

namespace clamor {

namespace {

struct Way {
  std::string strategy;
  Estimator estimator = Estimator::kAmplitude;
  std::size_t k = 0;
};

struct Outcome {
  double loudness_db = 0, l2 = 0, renormalised_l2 = 0;
};

// More drawings where one of them tells little and costs little.
std::size_t drawings(std::size_t k) { return std::clamp<std::size_t>(1024 / k, 1, 4); }

Outcome rendered(const ExperimentScene& scene, const Walk& here, double seconds, const Way& way,
                 const Sound& all) {
  Outcome outcome;
  const double whole = energy(all);
  const std::size_t count = drawings(way.k);
  for (std::size_t seed = 1; seed <= count; ++seed) {
    SeededSampler sampler = scene.sampler(way.strategy, way.k, way.estimator, seed);
    const Sound sound = scene.render(*sampler.sampler, here, seconds);
    const double power = energy(sound) / whole, product = inner_product(sound, all) / whole;
    const auto share = 1.0 / static_cast<double>(count);
    outcome.loudness_db += share * 10 * std::log10(power);
    outcome.l2 += share * std::sqrt(std::max(0.0, 1 - 2 * product + power));
    outcome.renormalised_l2 += share * std::sqrt(std::max(0.0, 2 - 2 * product / std::sqrt(power)));
  }
  return outcome;
}

// Figure 4.
void waveform_error(const ExperimentScene& scene, const Walk& here, double seconds,
                    const Sound& all, const std::vector<std::size_t>& sizes, ReportPage& report,
                    std::ostream& err) {
  std::vector<Way> ways;
  for (auto k = sizes.rbegin(); k != sizes.rend(); ++k)  // the longest first
    for (const StrategyInfo& info : kStrategies)
      if (const std::string name = info.name; name != "all")
        ways.push_back({name, name == "priority" ? Estimator::kPower : Estimator::kAmplitude, *k});
  std::vector<Outcome> outcomes(ways.size());
  for_each_index(ways.size(), [&](std::size_t w) {
    outcomes[w] = rendered(scene, here, seconds, ways[w], all);
  });

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
  Chart loudness{.title = "How much too loud",
                 .x_label = "k, sources mixed",
                 .y_label = "RMS level re all sources (dB)",
                 .log_x = true,
                 .x_ticks = ticks};
  ReportTable table{"figure_4", "Waveform error and level, rendered", {}, {}, false};
  table.columns = {"strategy", "estimator", "k", "loudness_db", "l2", "renormalised_l2"};
  for (const StrategyInfo& info : kStrategies) {
    Chart::Series of_absolute{.name = info.name, .colour = colour_of(info.name)};
    Chart::Series of_relative = of_absolute, of_loudness = of_absolute;
    for (std::size_t w = ways.size(); w-- > 0;) {  // ascending k
      if (ways[w].strategy != info.name) continue;
      const auto k = static_cast<double>(ways[w].k);
      const Outcome& outcome = outcomes[w];
      const bool power = ways[w].estimator == Estimator::kPower;
      table.rows.push_back({ways[w].strategy, power ? "power" : "amplitude", k, outcome.loudness_db,
                            outcome.l2, outcome.renormalised_l2});
      of_absolute.points.emplace_back(k, outcome.l2);
      of_relative.points.emplace_back(k, outcome.renormalised_l2);
      of_loudness.points.emplace_back(k, outcome.loudness_db);
    }
    if (of_absolute.points.empty()) continue;
    absolute.series.push_back(of_absolute);
    relative.series.push_back(of_relative);
    loudness.series.push_back(of_loudness);
  }
  // k^-1/2 through the first point of the octree, which the paper used.
  Chart::Series slope{"k^-1/2", {}, Chart::Series::Look::kDashes, Chart::kGrey};
  for (const Way& way : ways)
    if (way.strategy == "octree" && way.k == sizes.front())
      for (const std::size_t k : sizes)
        slope.points.emplace_back(
            static_cast<double>(k),
            outcomes[static_cast<std::size_t>(&way - ways.data())].l2 *
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
                  "per point. A renormalised error of 1.41 is that of a sound that has "
                  "nothing to do with the original.",
                  seconds));
  report.table(std::move(table));
  err << "  figure 4 is done" << std::endl;
}

// As loud as `like`.
Sound brought_to(const Sound& like, Sound sound) {
  const auto gain = static_cast<float>(std::sqrt(energy(like) / energy(sound)));
  for (auto& channel : sound.channels)
    for (float& sample : channel) sample *= gain;
  return sound;
}

// Figure 5.
void perception(const ExperimentScene& scene, const Walk& here, double seconds, const Sound& all,
                const std::vector<std::size_t>& sizes, int rolls, ReportPage& report,
                std::ostream& err) {
  const SoundAnalysis original = analyse(all, SoundKind::kProgramme);
  int done = 0;
  std::mutex printing;
  const NullDistribution chance = null_distribution(rolls, [&](std::uint32_t roll) {
    SeededSampler sampler = scene.sampler("all", 1, Estimator::kPower, 1);
    const Sound other = scene.render(*sampler.sampler, here, seconds, 1000 + roll);
    auto differences = compare(original, analyse(brought_to(all, other), SoundKind::kProgramme));
    const std::scoped_lock lock(printing);
    err << fmt::format("  figure 5: exact rendering {} of {}\n", ++done, rolls) << std::flush;
    return differences;
  });

  const std::vector<Way> kinds = {{"octree", Estimator::kAmplitude, 0},
                                  {"importance", Estimator::kAmplitude, 0},
                                  {"priority", Estimator::kPower, 0}};
  // Of the waveform itself another phase changes everything, and nobody hears it.
  const auto counts = [&](const Difference& difference) {
    switch (difference.info->measure) {
      case Measure::kL2:
      case Measure::kRenormalisedL2:
      case Measure::kCorrelation:
        return false;
      default:
        return difference.worst() != nullptr;
    }
  };
  std::vector<Way> ways;
  for (auto k = sizes.rbegin(); k != sizes.rend(); ++k)
    for (Way way : kinds) {
      way.k = *k;
      ways.push_back(way);
    }
  std::vector<std::vector<Difference>> differences(ways.size());
  for_each_index(ways.size(), [&](std::size_t w) {
    SeededSampler sampler = scene.sampler(ways[w].strategy, ways[w].k, ways[w].estimator, 1);
    const Sound sound = brought_to(all, scene.render(*sampler.sampler, here, seconds));
    differences[w] = compare(original, analyse(sound, SoundKind::kProgramme));
  });

  std::vector<double> ticks(sizes.begin(), sizes.end());
  Chart share{.title = "Figure 5: measures by which the sample is told from an exact rendering",
              .x_label = "k, sources mixed",
              .y_label = "measures beyond chance (%)",
              .log_x = true,
              .x_ticks = ticks,
              .y_range = {{0, 100}}};
  share.zones = {
      {32, 181, "paper: bad"}, {1448, 4096, "satisfactory"}, {6000, 32768, "very close"}};
  Chart typical{.title = "Figure 5: how far beyond, the geometric mean of the measures",
                .x_label = "k, sources mixed",
                .y_label = "difference / 95th percentile of chance",
                .log_x = true,
                .log_y = true,
                .x_ticks = ticks};
  ReportTable table{"figure_5",
                    "Each measure: difference over what chance makes (95th percentile)",
                    {"strategy", "measure", "k", "difference", "chance_95", "ratio"},
                    {},
                    true};
  ReportTable summary{"figure_5_summary", "Measures beyond chance", {}, {}, false};
  summary.columns = {"strategy", "k", "beyond", "of", "typical_ratio", "beyond_which"};
  for (const Way& kind : kinds) {
    Chart::Series of_share{.name = kind.strategy, .colour = colour_of(kind.strategy)};
    Chart::Series of_typical = of_share;
    for (std::size_t w = ways.size(); w-- > 0;) {
      if (ways[w].strategy != kind.strategy) continue;
      int beyond = 0, taken = 0;
      double logs = 0;
      std::string which;
      for (const Difference& difference : differences[w]) {
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
        table.rows.push_back({ways[w].strategy, difference.info->key,
                              static_cast<double>(ways[w].k), size, by_chance, ratio});
      }
      const auto k = static_cast<double>(ways[w].k);
      of_share.points.emplace_back(k, 100.0 * beyond / std::max(taken, 1));
      of_typical.points.emplace_back(k, std::exp(logs / std::max(taken, 1)));
      summary.rows.push_back({ways[w].strategy, k, static_cast<double>(beyond),
                              static_cast<double>(taken), of_typical.points.back().second, which});
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

  report.heading("Figure 5: what the ear could tell");
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

std::string figure_4_text(const ReportTable& table) {
  struct Off {
    double db = 0, k = 0;
    std::string strategy;
  };
  Off ours, theirs;  // the furthest from the level of all sources
  std::map<std::size_t, double> our_error, best_of_paper;
  const auto k_of = column_of(table, "k"), level_db = column_of(table, "loudness_db"),
             error = column_of(table, "renormalised_l2");
  for (std::size_t i = 0; i < table.rows.size(); ++i) {
    const std::string& strategy = std::get<std::string>(table.rows[i][0]);
    Off& furthest = strategy == "priority" ? ours : theirs;
    if (std::abs(level_db[i]) >= std::abs(furthest.db)) furthest = {level_db[i], k_of[i], strategy};
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
  std::vector<WorseThanPaper> defeats;
  std::size_t compared = 0;
  for (const auto& [k, of_priority] : our_error) {
    if (k < 128 || !best_of_paper.contains(k)) continue;
    ++compared;
    if (of_priority > best_of_paper[k]) defeats.push_back({k, of_priority, best_of_paper[k]});
  }
  if (compared == 0) return text;
  text += " From k = 128 up, its renormalised error is ";
  return text + (defeats.size() == compared ? "nowhere below the best of the paper's strategies."
                                            : "below the best of the paper's strategies " +
                                                  at_every_k_except(defeats) + ".");
}

std::string at_every_k_except(std::span<const WorseThanPaper> defeats) {
  std::string words = "at every k";
  for (const WorseThanPaper& defeat : defeats)
    words += fmt::format("{} {} ({:.2f}, the best of the paper's {:.2f})",
                         &defeat == &defeats.front()  ? " but"
                         : &defeat == &defeats.back() ? " and"
                                                      : ",",
                         defeat.k, defeat.ours, defeat.theirs);
  return words;
}

std::vector<std::size_t> sample_sizes(const ExperimentScene& scene, std::size_t most) {
  std::vector<std::size_t> sizes;
  for (std::size_t k = 32; k <= most && 2 * k <= scene.size(); k *= 2) sizes.push_back(k);
  return sizes;
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
  // Textures need 1.5 s to have statistics.
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
