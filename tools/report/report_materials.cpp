#include "tools/report/report_materials.h"

#include <algorithm>
#include <array>
#include <string>
#include <vector>

#include <fmt/format.h>

#include "bake/report/lost_power.h"
#include "tools/analysis/chart.h"
#include "tools/program/text_format.h"
#include "tools/report/report_words.h"

namespace clamor {

namespace {

constexpr std::size_t kShownMaterials = 7, k1000Hz = 4;
// Colours of the palette that no material has.
constexpr int kAirColour = 7, kLeftColour = 8;

}  // namespace

void write_materials(const BakeFile& file, std::span<const MetMaterial> materials,
                     ReportPage& page) {
  const BakeStatistics& statistics = file.statistics();
  page.heading("What absorbs the sound");
  if (materials.empty()) {
    page.paragraph(
        statistics.bounces == 0
            ? "Sound met no surfaces."
            : "The bake was made by an older program, which did not count it: bake again.");
    return;
  }
  Chart curves{.title = "Absorption by material",
               .x_label = "octave (Hz)",
               .y_label = "share absorbed",
               .log_x = true};
  curves.x_ticks.assign(kBandCentres_hz.begin(), kBandCentres_hz.end());
  curves.y_range = {{0, 1}};
  curves.width = 560;
  curves.height = 340;
  BarChart bars{.title = "Where sound is absorbed",
                .x_label = "octave (Hz)",
                .y_label = "share of the power (%)"};
  bars.width = 560;
  bars.height = 340;
  for (std::size_t b = 0; b < kBandCount; ++b)
    bars.columns.push_back(short_number(kBandCentres_hz[b]));
  const auto percent = [&](std::size_t b, double power) {
    const double emitted = statistics.power_emitted[b];
    return emitted > 0 ? 100 * power / emitted : 0.0;
  };
  BarChart::Part rest{
      .name = "all others", .values = std::vector<double>(kBandCount, 0), .colour = Chart::kGrey};
  std::vector<double> in_air(kBandCount), left(kBandCount);
  for (std::size_t b = 0; b < kBandCount; ++b) {
    left[b] = percent(b, static_cast<double>(statistics.power_escaped[b]));
    in_air[b] = 100 - left[b] - percent(b, static_cast<double>(statistics.power_unfinished[b]));
  }
  std::array<double, kBandCount> all{};
  for (const MetMaterial& material : materials)
    for (std::size_t b = 0; b < kBandCount; ++b) all[b] += static_cast<double>(material.arrived[b]);
  ReportTable table{"materials",
                    "Materials by what they absorb: the share of the sound that meets them, and "
                    "what they absorb of that",
                    band_columns("material"),
                    {}};
  table.columns.insert(table.columns.begin() + 1, "met at 1 kHz (%)");
  for (std::size_t i = 0; i < materials.size(); ++i) {
    const MetMaterial& material = materials[i];
    const bool shown = i < kShownMaterials;
    Chart::Series series{.name = shortened(material.name, 24), .look = Chart::Series::Look::kLine};
    BarChart::Part part{.name = shortened(material.name, 24)};
    std::vector<ReportTable::Cell> row = {material.name, ""};
    if (all[k1000Hz] > 0)
      row[1] = fmt::format("{:.1f}",
                           100 * static_cast<double>(material.arrived[k1000Hz]) / all[k1000Hz]);
    for (std::size_t b = 0; b < kBandCount; ++b) {
      const double taken = percent(b, material.dissipated(b));
      series.points.emplace_back(kBandCentres_hz[b], material.absorption[b]);
      part.values.push_back(taken);
      in_air[b] -= taken;
      if (!shown) rest.values[b] += taken;
      row.emplace_back(fmt::format("{:.2f}", material.absorption[b]));
    }
    table.rows.push_back(std::move(row));
    if (!shown) continue;
    curves.series.push_back(std::move(series));
    bars.parts.push_back(std::move(part));
  }
  if (materials.size() > kShownMaterials) bars.parts.push_back(std::move(rest));
  // The photons are a sample, so that what is left for the air may be a little below nothing.
  for (double& share : in_air) share = std::max(0.0, share);
  bars.parts.push_back({.name = "air", .values = std::move(in_air), .colour = kAirColour});
  const LostPower lost = lost_power(statistics, file.materials());
  if (lost.all() > 0)
    bars.parts.push_back({.name = !(lost.through_walls > 0)      ? "left through openings"
                                  : !(lost.through_openings > 0) ? "left through walls"
                                                                 : "left the level",
                          .values = std::move(left),
                          .colour = kLeftColour});
  const std::string caption = fmt::format(
      "The {} that absorb most. Right: where the power of the emitters went, as the photons of the "
      "bake met surfaces.",
      counted(std::min(materials.size(), kShownMaterials), "material"));
  page.markup("<div class=\"row\" style=\"--columns: 2\"><figure>" + to_svg(curves) +
              "</figure><figure>" + to_svg(bars) + "</figure></div><p class=\"note\">" +
              escaped(caption) + "</p>\n");
  table.folded = materials.size() > 12;
  page.table(std::move(table));
}

}  // namespace clamor
