// experiment_octave_bands.cpp: sampling each octave band of a source separately, as in the paper,
// or all bands together.
//
// The paper splits the violin into eight octave bands and treats each "as different input sound
// sources": k samples are k pairs of a source and a band. Clamor chooses a source once for all its
// bands. Only powers are computed; each sample gives eight band levels.
#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <ostream>

#include <fmt/format.h>

#include "runtime/propagation/loudness.h"
#include "tools/experiments/baked_level.h"
#include "tools/experiments/experiments.h"

namespace clamor {

namespace {

using BandLevels = std::array<double, kBandCount>;

struct Spread {
  BandLevels rms_db{};
};

Spread spread_of(const std::vector<BandLevels>& drawings, const BandLevels& whole) {
  Spread spread;
  for (std::size_t b = 0; b < kBandCount; ++b) {
    double squares = 0;
    for (const BandLevels& levels : drawings) {
      const double db = levels[b] > 0 ? 10 * std::log10(levels[b] / whole[b]) : -20;
      squares += db * db;
    }
    spread.rms_db[b] = std::sqrt(squares / static_cast<double>(drawings.size()));
  }
  return spread;
}

// Power and weight of each band of each source at a place.
struct BandPowers {
  std::vector<double> weights;  // [source][band]
  std::vector<Bands> powers;    // [source]
  BandLevels whole{};           // of all sources
};

BandPowers band_powers(const ExperimentScene& scene, const Vec3& place) {
  BandPowers result;
  const Bands loudness = loudness_weights();
  const auto prepared = prepare_signals(scene.input().signals);
  for (const Source& source : scene.input().sources) {
    Bands power = scene.radiation().intensity(source, place);
    const Bands& signal = prepared[scene.radiation().signal(source)].mean_square();
    for (std::size_t b = 0; b < kBandCount; ++b) {
      power[b] *= signal[b];
      result.whole[b] += power[b];
      result.weights.push_back(static_cast<double>(loudness[b]) * power[b]);
    }
    result.powers.push_back(power);
  }
  return result;
}

// Band levels of k samples for each seed: pairs of a source and a band, or sources with all bands.
struct DrawnLevels {
  std::vector<BandLevels> apart, together;
};

DrawnLevels draw_levels(const ExperimentScene& scene, const Vec3& place, const BandPowers& all,
                        std::size_t k, std::size_t seeds) {
  DrawnLevels drawn{std::vector<BandLevels>(seeds), std::vector<BandLevels>(seeds)};
  const auto probabilities = inclusion_probabilities(all.weights, k);
  for_each_index(seeds, [&](std::size_t i) {
    Draws draws(2 + i, 0);
    for (const std::uint32_t pair : choose_without_replacement(probabilities, draws))
      drawn.apart[i][pair % kBandCount] +=
          all.powers[pair / kBandCount][pair % kBandCount] / probabilities[pair];
    SeededSampler sampler = scene.sampler("priority", k, Estimator::kPower, 2 + i);
    for (const SampledSource& chosen : sampler.sample(place))
      for (std::size_t b = 0; b < kBandCount; ++b)
        drawn.together[i][b] += chosen.power_scale * all.powers[chosen.number][b];
  });
  return drawn;
}

void add_spread(const Spread& spread, bool together, std::size_t k, int colour, ReportTable& table,
                Chart& chart) {
  std::vector<ReportTable::Cell> row = {together ? "in one source (priority)" : "apart (paper)",
                                        static_cast<double>(k)};
  Chart::Series series{fmt::format("{}, k = {}", together ? "in one" : "apart", k),
                       {},
                       together ? Chart::Series::Look::kLineAndDots : Chart::Series::Look::kDashes,
                       colour};
  for (std::size_t b = 0; b < kBandCount; ++b) {
    row.emplace_back(spread.rms_db[b]);
    series.points.emplace_back(kBandCentres_hz[b], spread.rms_db[b]);
  }
  table.rows.push_back(std::move(row));
  chart.series.push_back(series);
}

}  // namespace

std::string bands_text(const ReportTable& table) {
  std::string text;
  for (const auto& row : table.rows) {
    double worst_db = 0;
    std::size_t at = 2;
    for (std::size_t c = 2; c < row.size(); ++c)
      if (const double db = std::get<double>(row[c]); db > worst_db) worst_db = db, at = c;
    text += fmt::format("{}{}, k = {}: up to {:.2f} dB off ({})", text.empty() ? "" : "; ",
                        std::get<std::string>(row[0]), std::get<double>(row[1]), worst_db,
                        table.columns[at]);
  }
  return text + ".";
}

Result<ReportPage> octave_bands_experiment(const ExperimentOptions& options, std::ostream& err) {
  auto level = BakedLevel::open(options.level);
  if (!level.ok()) return level.error();
  level->set_phong({0, 2, 5, 10, 20, 40, 70, 100});
  const auto scene = level->rebake(options.quick ? kQuickSources : 50000);
  if (!scene.ok()) return scene.error();
  const Vec3 place = options.listener_m.value_or((*scene)->default_listener_m());
  const auto seeds = static_cast<std::size_t>(options.quick ? 10 : options.seeds);
  const BandPowers all = band_powers(**scene, place);
  ReportPage report(
      "octave-bands", "Eight octave bands: apart, or in one source",
      fmt::format("The level of {} with Phong exponents from diffuse at 63 Hz to 100 at 8 kHz; {} "
                  "sources; {} drawings each",
                  options.level, all.powers.size(), seeds));
  ReportTable table{"bands", "Spread of band levels over drawings (dB, RMS)", {}, {}};
  table.columns = {"bands", "k"};
  for (const double hz : kBandCentres_hz) table.columns.push_back(fmt::format("{:g}_hz", hz));
  Chart chart{.title = "Error of the band levels",
              .x_label = "octave band (Hz)",
              .y_label = "RMS over drawings (dB)",
              .log_x = true,
              .log_y = true,
              .x_ticks = {kBandCentres_hz.begin(), kBandCentres_hz.end()}};
  const std::vector<std::size_t> sizes =
      options.quick ? std::vector<std::size_t>{150} : std::vector<std::size_t>{150, 2000, 20000};
  int colour = 0;
  for (const std::size_t k : sizes) {
    err << "  k = " << k << std::endl;
    const DrawnLevels drawn = draw_levels(**scene, place, all, k, seeds);
    add_spread(spread_of(drawn.apart, all.whole), false, k, colour, table, chart);
    add_spread(spread_of(drawn.together, all.whole), true, k, colour, table, chart);
    ++colour;
  }
  report.claim(
      "\"A large sample size is especially required for the last case of sampling multiple "
      "frequency "
      "bands. The random selection of frequency bands leads to a larger deviation. Further "
      "experiments "
      "are necessary to quantify this effect.\" (5.2)",
      "Dashed, k pairs of a source and a band are drawn by importance, as the paper does; solid, k "
      "sources by priority, each with all of its bands. " +
          bands_text(table));
  report.chart(chart, "A band of which nothing was drawn counts as 20 dB off.");
  report.table(std::move(table));
  return report;
}

}  // namespace clamor
