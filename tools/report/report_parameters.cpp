#include "tools/report/report_parameters.h"

#include <string>
#include <vector>

#include <fmt/format.h>

#include "tools/analysis/chart.h"
#include "tools/report/report_words.h"
#include "tools/report/room_summary.h"

namespace clamor {

namespace {

// The just-noticeable difference, in words.
std::string noticeable_text(const ParameterKind& kind) {
  return kind.is_share
             ? fmt::format("{:.0f} %", 100 * kind.noticeable)
             : fmt::format("{:g}{}{}", kind.noticeable, kind.unit[0] != 0 ? " " : "", kind.unit);
}

Chart parameter_chart(const ReportContents& contents, const ParameterKind& kind) {
  Chart chart{
      .title = title_of(kind), .x_label = "octave (Hz)", .y_label = title_of(kind), .log_x = true};
  chart.x_ticks.assign(kBandCentres_hz.begin(), kBandCentres_hz.end());
  chart.width = 420;
  chart.height = 290;
  const auto& responses = contents.measured.responses;
  Chart::Ribbon ribbon;
  for (std::size_t b = 0; b < kBandCount; ++b) {
    double sum = 0;
    int count = 0;
    for (const RoomResponse& response : responses)
      if (const auto& value = (response.parameters.*kind.value)[b]) sum += *value, ++count;
    if (count == 0) continue;
    const double mean = sum / count, most = kind.noticeable_at(mean);
    ribbon.points.push_back({kBandCentres_hz[b], mean - most, mean + most});
  }
  chart.ribbons = {ribbon};
  const auto add = [&](const MeasuredRoom& measured, Chart::Series::Look look) {
    for (std::size_t i = 0; i < measured.responses.size(); ++i) {
      Chart::Series series{.look = look, .colour = static_cast<int>(i)};
      for (std::size_t b = 0; b < kBandCount; ++b)
        if (const auto& value = (measured.responses[i].parameters.*kind.value)[b])
          series.points.emplace_back(kBandCentres_hz[b], *value);
      chart.series.push_back(std::move(series));
    }
  };
  add(contents.measured, Chart::Series::Look::kLineAndDots);
  if (contents.other) add(*contents.other, Chart::Series::Look::kDashes);
  return chart;
}

// The bass of the decay against its middle: what a designer mends first.
Chart decay_chart(const ReportContents& contents) {
  Chart chart{.title = "Decay over frequency",
              .x_label = "octave (Hz)",
              .y_label = "T30 over its mean at 500 Hz and 1 kHz",
              .log_x = true};
  chart.x_ticks.assign(kBandCentres_hz.begin(), kBandCentres_hz.end());
  chart.width = 420;
  chart.height = 290;
  const auto& responses = contents.measured.responses;
  for (std::size_t i = 0; i < responses.size(); ++i) {
    Chart::Series series{.colour = static_cast<int>(i)};
    const auto middle = middle_value(std::span(&responses[i], 1), kind_of("T30"));
    for (std::size_t b = 0; middle && b < kBandCount; ++b)
      if (const auto& value = responses[i].parameters.t30_s[b])
        series.points.emplace_back(kBandCentres_hz[b], *value / *middle);
    chart.series.push_back(std::move(series));
  }
  return chart;
}

ReportTable parameter_table(std::size_t listener, const MeasuredRoom& measured) {
  const RoomResponse& response = measured.responses[listener];
  ReportTable table{
      "parameters", listener_title(listener, response.listener_m), band_columns("parameter"), {}};
  table.columns.push_back("noticeable");
  for (const ParameterKind& kind : kParameterKinds) {
    std::vector<ReportTable::Cell> row = {title_of(kind)};
    for (const auto& value : response.parameters.*kind.value)
      row.emplace_back(value_text(value, kind.digits));
    row.emplace_back(noticeable_text(kind));
    table.rows.push_back(std::move(row));
  }
  return table;
}

// How many just-noticeable differences lie between the two bakes.
ReportTable difference_table(const ReportContents& contents, std::size_t listener) {
  const RoomResponse& here = contents.measured.responses[listener];
  const RoomResponse& there = contents.other->responses[listener];
  ReportTable table{
      "differences",
      fmt::format("{} in {}: difference in just-noticeable differences",
                  listener_title(listener, here.listener_m), file_name(contents.other->file())),
      band_columns("parameter"),
      {}};
  for (const ParameterKind& kind : kParameterKinds) {
    std::vector<ReportTable::Cell> row = {std::string(kind.name)};
    for (std::size_t b = 0; b < kBandCount; ++b) {
      const auto& a = (here.parameters.*kind.value)[b];
      const auto& other = (there.parameters.*kind.value)[b];
      row.emplace_back(a && other && kind.noticeable_at(*a) > 0
                           ? fmt::format("{:+.1f}", (*other - *a) / kind.noticeable_at(*a))
                           : "-");
    }
    table.rows.push_back(std::move(row));
  }
  return table;
}

// The table of clamor inspect.
ReportTable bake_table(const ReportContents& contents) {
  ReportTable table{"acoustics",
                    "What the bake measured while tracing, as clamor inspect prints it",
                    band_columns("acoustics"),
                    {}};
  for (const BandRow& line : acoustic_rows(contents.measured.file(), contents.overview)) {
    std::vector<ReportTable::Cell> row = {line.title};
    for (std::size_t b = 0; b < kBandCount; ++b) row.emplace_back(line.text(b));
    table.rows.push_back(std::move(row));
  }
  table.folded = true;
  return table;
}

}  // namespace

// Charts of the parameters over frequency, and what listeners differ by.
void write_parameters(const ReportContents& contents, ReportPage& page) {
  page.heading("What it sounds like");
  const auto& responses = contents.measured.responses;
  std::string legend = "<p class=\"note\">";
  for (std::size_t i = 0; i < responses.size(); ++i)
    legend += fmt::format("<span class=\"swatch s{}\"></span>listener {}: {} m &emsp;", i % 9,
                          i + 1, place_text(responses[i].listener_m));
  if (contents.other)
    legend += fmt::format("lines: {}, dashes: {}", escaped(file_name(contents.measured.file())),
                          escaped(file_name(contents.other->file())));
  page.markup(legend + "</p>\n");
  std::vector<Chart> charts;
  for (const char* name : {"T30", "EDT", "C80", "D50", "G"})
    charts.push_back(parameter_chart(contents, kind_of(name)));
  charts.push_back(decay_chart(contents));
  page.charts(
      charts, 3,
      fmt::format(
          "Room parameters of ISO 3382-1 in octaves{}. Listeners who differ by less than the "
          "grey "
          "band hear the same: it is one just-noticeable difference either way of their mean.",
          contents.other ? ", dashed those of " + file_name(contents.other->file()) : ""));
  for (std::size_t i = 0; i < responses.size(); ++i) {
    ReportTable parameters = parameter_table(i, contents.measured);
    parameters.folded = i > 0;
    page.table(std::move(parameters));
    if (!contents.other) continue;
    ReportTable differences = difference_table(contents, i);
    differences.folded = i > 0;
    page.table(std::move(differences));
  }
  page.table(bake_table(contents));
}

}  // namespace clamor
