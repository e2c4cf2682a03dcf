// experiment_octave_bands.cpp: sampling each octave band of a source separately, as in the paper,
// or all bands together.
//
// The paper splits the violin into eight octave bands and treats each "as different input sound
// sources": k samples are k pairs of a source and a band. Clamor chooses a source once for all its
// bands. Only powers are computed; each sample gives eight band levels.
#include <array>
#include <cmath>
#include <ostream>

#include <fmt/format.h>

#include "runtime/propagation/loudness.h"
#include "tools/experiments/baked_level.h"
#include "tools/experiments/experiment_scene.h"
#include "tools/experiments/experiments.h"
#include "tools/strategies/importance_sampling.h"

namespace clamor {

namespace {

using BandLevels = std::array<double, kBandCount>;

// Power and weight of each band of each source at a place.
struct BandPowers {
  std::vector<double> weights;  // [source][band]
  std::vector<Bands> powers;    // [source]
  BandLevels whole{};           // of all sources
};

BandPowers band_powers(const ExperimentScene& scene, const Vec3& place) {
  BandPowers result;
  const Bands loudness = loudness_weights();
  for (const Source& source : scene.input().sources) {
    const Bands power =
        weighted(scene.mean_square(source), scene.radiation().intensity(source, place));
    for (std::size_t b = 0; b < kBandCount; ++b) {
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

// Adds a row and a line: the root mean square error of each band over the drawings.
void add_spread(const std::vector<BandLevels>& drawings, const BandLevels& whole, bool together,
                std::size_t k, int colour, ReportTable& table, Chart& chart) {
  using Look = Chart::Series::Look;
  auto& row = table.rows.emplace_back();
  row = {together ? "in one source (priority)" : "apart (paper)", k};
  auto& series = chart.series.emplace_back();
  series = {fmt::format("{}, k = {}", together ? "in one" : "apart", k),
            {},
            together ? Look::kLineAndDots : Look::kDashes,
            colour};
  for (std::size_t b = 0; b < kBandCount; ++b) {
    double squares = 0;
    for (const BandLevels& levels : drawings) squares += std::pow(level_db(levels[b], whole[b]), 2);
    row.emplace_back(std::sqrt(squares / static_cast<double>(drawings.size())));
    series.points.emplace_back(kBandCentres_hz[b], std::get<double>(row.back()));
  }
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
  const Vec3 place = options.place_in(**scene);
  const auto seeds = static_cast<std::size_t>(options.quick ? 10 : options.seeds);
  const BandPowers all = band_powers(**scene, place);
  ReportPage report(
      "octave-bands", "Eight octave bands: apart, or in one source",
      fmt::format("The level of {} with Phong exponents from diffuse at 63 Hz to 100 at 8 kHz; {} "
                  "sources; {} drawings each",
                  options.level, all.powers.size(), seeds));
  ReportTable table{"bands", "Spread of band levels over drawings (dB, RMS)", octave_columns({"bands", "k"}), {}};
  Chart chart{.title = "Error of the band levels",
              .x_label = "octave band (Hz)",
              .y_label = "RMS over drawings (dB)",
              .log_x = true,
              .log_y = true,
              .x_ticks = {kBandCentres_hz.begin(), kBandCentres_hz.end()}};
  int colour = 0;
  for (const std::size_t k : {150, 2000, 20000}) {
    if (options.quick && colour > 0) break;
    err << "  k = " << k << std::endl;
    const DrawnLevels drawn = draw_levels(**scene, place, all, k, seeds);
    add_spread(drawn.apart, all.whole, false, k, colour, table, chart);
    add_spread(drawn.together, all.whole, true, k, colour++, table, chart);
  }
  report.claim(
      "\"A large sample size is especially required for the last case of sampling multiple "
      "frequency bands. The random selection of frequency bands leads to a larger deviation. "
      "Further experiments are necessary to quantify this effect.\" (5.2)",
      "Dashed, k pairs of a source and a band are drawn by importance, as the paper does; solid, k "
      "sources by priority, each with all of its bands. " +
          bands_text(table));
  report.chart(chart, "A band of which nothing was drawn counts as 20 dB off.");
  report.table(std::move(table));
  return report;
}

}  // namespace clamor
