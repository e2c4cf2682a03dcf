#include "tools/report/report_materials.h"

#include <algorithm>
#include <string>
#include <vector>

#include <fmt/format.h>

#include "tools/analysis/chart.h"
#include "tools/program/text_format.h"
#include "tools/report/report_words.h"

namespace clamor {

namespace {

constexpr std::size_t kShownMaterials = 7;

}  // namespace

void write_materials(std::span<const AbsorbingArea> areas, ReportPage& page) {
  page.heading("What absorbs the sound");
  if (areas.empty()) {
    page.paragraph("The level has no surfaces.");
    return;
  }
  double all_m2 = 0;
  for (const AbsorbingArea& area : areas) all_m2 += area.area_m2;
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
                .y_label = "open window of the same effect (m2)"};
  bars.width = 560;
  bars.height = 340;
  for (std::size_t b = 0; b < kBandCount; ++b)
    bars.columns.push_back(short_number(kBandCentres_hz[b]));
  BarChart::Part rest{
      .name = "all others", .values = std::vector<double>(kBandCount, 0), .colour = Chart::kGrey};
  for (std::size_t i = 0; i < areas.size(); ++i) {
    const AbsorbingArea& area = areas[i];
    const bool shown = i < kShownMaterials;
    Chart::Series series{.name = shortened(area.name, 24), .look = Chart::Series::Look::kLine};
    BarChart::Part part{.name = shortened(area.name, 24)};
    for (std::size_t b = 0; b < kBandCount; ++b) {
      series.points.emplace_back(kBandCentres_hz[b], area.absorption[b]);
      part.values.push_back(area.absorbed_m2(b));
      if (!shown) rest.values[b] += area.absorbed_m2(b);
    }
    if (!shown) continue;
    curves.series.push_back(std::move(series));
    bars.parts.push_back(std::move(part));
  }
  if (areas.size() > kShownMaterials) bars.parts.push_back(std::move(rest));
  const std::string caption = fmt::format(
      "The {} of largest area. Right: area times absorption, which is what shortens the decay of "
      "an octave.",
      counted(std::min(areas.size(), kShownMaterials), "material"));
  page.markup("<div class=\"row\" style=\"--columns: 2\"><figure>" + to_svg(curves) +
              "</figure><figure>" + to_svg(bars) + "</figure></div><p class=\"note\">" +
              escaped(caption) + "</p>\n");
  ReportTable table{"materials",
                    "Materials by area, and the share of sound that they absorb",
                    band_columns("material"),
                    {}};
  table.columns.insert(table.columns.begin() + 1, {"area (m2)", "area (%)"});
  for (const AbsorbingArea& area : areas) {
    std::vector<ReportTable::Cell> row = {area.name, fmt::format("{:.1f}", area.area_m2),
                                          fmt::format("{:.1f}", 100 * area.area_m2 / all_m2)};
    for (const float absorption : area.absorption)
      row.emplace_back(fmt::format("{:.2f}", absorption));
    table.rows.push_back(std::move(row));
  }
  table.folded = areas.size() > 12;
  page.table(std::move(table));
}

}  // namespace clamor
