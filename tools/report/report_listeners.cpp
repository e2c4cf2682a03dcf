#include "tools/report/report_listeners.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include <fmt/format.h>

#include "common/sample_rate.h"
#include "runtime/response/impulse_response.h"
#include "tools/analysis/chart.h"
#include "tools/program/text_format.h"
#include "tools/report/report_words.h"

namespace clamor {

namespace {

constexpr std::size_t kEchoBand = 4;  // 1 kHz
constexpr double kEchogram_s = 0.3, kEchoBin_s = 0.002, kEchoFloor_db = -70;
constexpr double kWaveform_s = 0.25;
constexpr double kClarity_s = 0.08;

std::pair<Chart, ReportTable> echogram_of(const RoomResponse& response) {
  Chart chart{.title = "Echogram, 1 kHz",
              .x_label = "time after the direct sound (ms)",
              .y_label = "energy (dB)"};
  chart.width = 420;
  chart.height = 290;
  chart.y_range = {{kEchoFloor_db, 0}};
  chart.zones = {{0, 1e3 * kClarity_s, "early"}, {1e3 * kClarity_s, 1e3 * kEchogram_s, "late"}};
  std::vector<double> bins(static_cast<std::size_t>(std::lround(kEchogram_s / kEchoBin_s)), 0);
  double all = 0;
  for (const Arrival& arrival : response.arrivals) {
    const double energy = arrival.energy[kEchoBand],
                 t_s = arrival.time_s - response.arrivals.front().time_s;
    all += energy;
    if (const auto bin = static_cast<std::size_t>(t_s / kEchoBin_s); bin < bins.size())
      bins[bin] += energy;
  }
  Chart::Series series{.look = Chart::Series::Look::kLine, .colour = 1};
  ReportTable table{
      "echogram", "The echogram as a table", {"from (ms)", "to (ms)", "energy (dB)"}, {}, true};
  constexpr std::size_t kPerRow = 10;
  double in_row = 0;
  for (std::size_t i = 0; i < bins.size(); ++i) {
    const double level_db =
        std::max(kEchoFloor_db, bins[i] > 0 ? 10 * std::log10(bins[i] / all) : kEchoFloor_db);
    series.points.emplace_back(1e3 * kEchoBin_s * static_cast<double>(i), level_db);
    series.points.emplace_back(1e3 * kEchoBin_s * static_cast<double>(i + 1), level_db);
    in_row += bins[i];
    if ((i + 1) % kPerRow != 0) continue;
    const double to_ms = 1e3 * kEchoBin_s * static_cast<double>(i + 1);
    table.rows.push_back({fmt::format("{:.0f}", to_ms - 1e3 * kEchoBin_s * kPerRow),
                          fmt::format("{:.0f}", to_ms),
                          in_row > 0 ? fmt::format("{:.1f}", 10 * std::log10(in_row / all)) : "-"});
    in_row = 0;
  }
  chart.series = {series};
  return {chart, table};
}

// Lowest and highest sample of each column of the chart.
std::pair<Chart, ReportTable> waveform_of(const RoomResponse& response) {
  Chart chart{
      .title = "Impulse response", .x_label = "time after emission (ms)", .y_label = "pressure"};
  chart.width = 420;
  chart.height = 290;
  const auto first = static_cast<std::size_t>(
      std::max(0.0, response.arrivals.front().time_s - 0.01) * kSampleRate_hz);
  const auto wide = static_cast<std::size_t>(kWaveform_s * kSampleRate_hz);
  const std::vector<float> samples = impulse_response(response.arrivals, wide, first);
  Chart::Series series{.look = Chart::Series::Look::kThin, .colour = 1};
  ReportTable table{"waveform",
                    "The impulse response as a table",
                    {"from (ms)", "to (ms)", "lowest", "highest"},
                    {},
                    true};
  constexpr std::size_t kColumns = 500, kPerRow = 25;
  float row_low = 0, row_high = 0;
  const auto ms_at = [&](std::size_t column) {
    return 1e3 * (static_cast<double>(first) + static_cast<double>(column * wide) / kColumns) /
           kSampleRate_hz;
  };
  for (std::size_t c = 0; c < kColumns; ++c) {
    const auto [low, high] = std::minmax_element(
        samples.begin() + static_cast<std::ptrdiff_t>(c * wide / kColumns),
        samples.begin() + static_cast<std::ptrdiff_t>((c + 1) * wide / kColumns));
    series.points.emplace_back(ms_at(c), *low);
    series.points.emplace_back(ms_at(c), *high);
    row_low = std::min(row_low, *low);
    row_high = std::max(row_high, *high);
    if ((c + 1) % kPerRow != 0) continue;
    table.rows.push_back({fmt::format("{:.1f}", ms_at(c + 1 - kPerRow)),
                          fmt::format("{:.1f}", ms_at(c + 1)), fmt::format("{:.4f}", row_low),
                          fmt::format("{:.4f}", row_high)});
    row_low = row_high = 0;
  }
  chart.series = {series};
  return {chart, table};
}

void write_listener(const ReportContents& contents, std::size_t index, ReportPage& page) {
  const RoomResponse& response = contents.measured.responses[index];
  page.subheading(listener_title(index, response.listener_m));
  if (response.arrivals.empty()) {
    page.paragraph("Nothing is heard there.");
    return;
  }
  Chart decay{.title = "Energy decay",
              .x_label = "time after the direct sound (s)",
              .y_label = "energy still to come (dB)"};
  decay.width = 420;
  decay.height = 290;
  decay.y_range = {{-60, 0}};
  ReportTable decays{
      "decay", "The energy decay as a table (dB)", band_columns("time (s)"), {}, true};
  std::array<std::optional<DecayCurve>, kBandCount> curves;
  double end_s = 0.05;
  for (std::size_t b = 0; b < kBandCount; ++b) {
    curves[b] = energy_decay(response.arrivals, b);
    if (!curves[b]) continue;
    for (double t_s = 0.05; t_s < 20 && curves[b]->level_db(t_s) > -60; t_s *= 1.03)
      end_s = std::max(end_s, t_s);
  }
  constexpr int kSteps = 120, kRows = 20;
  for (std::size_t b = 0; b < kBandCount; ++b) {
    Chart::Series series{.name = band_title(b),
                         .look = Chart::Series::Look::kLine,
                         .colour = Chart::kBand + static_cast<int>(b)};
    for (int i = 0; curves[b] && i <= kSteps; ++i) {
      const double t_s = end_s * i / kSteps, level_db = curves[b]->level_db(t_s);
      if (level_db < -64) break;
      series.points.emplace_back(t_s, level_db);
    }
    decay.series.push_back(std::move(series));
  }
  for (int i = 0; i <= kRows; ++i) {
    const double t_s = end_s * i / kRows;
    std::vector<ReportTable::Cell> row = {fmt::format("{:.2f}", t_s)};
    for (std::size_t b = 0; b < kBandCount; ++b)
      row.emplace_back(curves[b] && curves[b]->level_db(t_s) > -100
                           ? fmt::format("{:.1f}", curves[b]->level_db(t_s))
                           : "-");
    decays.rows.push_back(std::move(row));
  }
  auto [echogram, echoes] = echogram_of(response);
  auto [waveform, samples] = waveform_of(response);
  page.charts(
      {decay, echogram, waveform}, 3,
      index > 0
          ? ""
          : fmt::format("Left: Schroeder's backward integral of the energies; a straight line is "
                        "an even decay, a "
                        "knee two rooms in one. Middle: energy at 1 kHz in steps of {:.0f} ms, "
                        "relative to all of it. "
                        "Right: an impulse response with these energies; 1 is the emitter at 1 m.",
                        1e3 * kEchoBin_s));
  page.table(std::move(decays));
  page.table(std::move(echoes));
  page.table(std::move(samples));
}

}  // namespace

void write_listeners(const ReportContents& contents, ReportPage& page) {
  const std::uint64_t all = contents.measured.file().source_count();
  page.heading("At the listeners");
  const std::size_t sources = contents.measured.responses[0].sources;
  page.paragraph(
      fmt::format("An impulse from {}. ", contents.measured.meter->excitation().words) +
      (sources < all / 2
           ? fmt::format(
                 "Each response is that of {} of the file's {}, a fair sample chosen for the "
                 "place: energies are right on average. --exact takes all.",
                 counted(sources, "source"), grouped(all))
           : "Each response is that of all sources."));
  for (std::size_t i = 0; i < contents.measured.responses.size(); ++i)
    write_listener(contents, i, page);
}

}  // namespace clamor
