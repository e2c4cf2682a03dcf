#include "tools/report/report_file.h"

#include <string>
#include <vector>

#include <fmt/format.h>

#include "tools/analysis/chart.h"
#include "tools/report/report_words.h"

namespace clamor {

void write_file(const ReportContents& contents, ReportPage& page) {
  const BakeFile& file = contents.measured.file();
  page.heading("The file");
  const BakeOverview& overview = contents.overview;
  BarChart power{.title = "Power by octree depth",
                 .x_label = "octave (Hz)",
                 .y_label = "share of the power (%)"};
  power.width = 560;
  power.height = 300;
  ReportTable shares{"power", "Power by octree depth (%)", band_columns("depth"), {}, true};
  for (std::size_t b = 0; b < kBandCount; ++b)
    power.columns.push_back(short_number(kBandCentres_hz[b]));
  const auto add = [&](const std::string& title, const Bands& bands) {
    BarChart::Part part{.name = title};
    std::vector<ReportTable::Cell> row = {title};
    for (std::size_t b = 0; b < kBandCount; ++b) {
      const double share = overview.power[b] > 0 ? 100.0 * static_cast<double>(bands[b]) /
                                                       static_cast<double>(overview.power[b])
                                                 : 0;
      part.values.push_back(share);
      row.emplace_back(fmt::format("{:.1f}", share));
    }
    power.parts.push_back(std::move(part));
    shares.rows.push_back(std::move(row));
  };
  for (std::size_t d = 0; d < overview.depths.size(); ++d)
    add(depth_title(d), overview.depths[d].power);
  if (overview.instanced.trees > 0) add("in instances", overview.instanced.stored.power);
  BarChart bytes{.title = "Bytes by section", .x_label = "section", .y_label = "MB"};
  bytes.width = 560;
  bytes.height = 300;
  ReportTable sizes{"bytes", "Bytes by section", {"section", "MB", "% of file"}, {}, true};
  BarChart::Part part{.name = "bytes", .colour = 1};
  const std::vector<ByteSection> sections = byte_sections(file);
  for (const ByteSection& section : sections) {
    const auto size = static_cast<double>(section.bytes),
               whole = static_cast<double>(sections.back().bytes);
    sizes.rows.push_back({std::string(section.title), fmt::format("{:.2f}", size / 1e6),
                          fmt::format("{:.1f}", 100 * size / whole)});
    if (&section == &sections.back()) continue;
    bytes.columns.emplace_back(section.title);
    part.values.push_back(size / 1e6);
  }
  bytes.parts = {part};
  page.charts({power, bytes}, 2,
              "Left: how much of the sound a player knows as it reads deeper. Right: where the "
              "bytes are.");
  page.table(std::move(shares));
  page.table(std::move(sizes));
  ReportTable making{"making", "How it was made", {"what", "how"}, {}};
  for (const MakingLine& line : making_lines(file, overview))
    making.rows.push_back({std::string(line.title), line.text});
  page.markup("<div class=\"words\">");
  page.table(std::move(making));
  page.markup("</div>");
}

}  // namespace clamor
