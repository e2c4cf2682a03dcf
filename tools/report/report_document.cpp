#include "tools/report/report_document.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>

#include <fmt/format.h>

#include "common/sample_rate.h"
#include "embedded_page.h"
#include "runtime/response/impulse_response.h"
#include "tools/analysis/report_page.h"
#include "tools/program/text_format.h"
#include "tools/report/room_summary.h"

namespace clamor {

namespace {

constexpr std::size_t kEchoBand = 4;  // 1 kHz
constexpr double kEchogram_s = 0.3, kEchoBin_s = 0.002, kEchoFloor_db = -70;
constexpr double kWaveform_s = 0.25;
constexpr std::size_t kShownMaterials = 7;
constexpr double kClarity_s = 0.08;

std::string file_name(const BakeFile& file) {
  return std::filesystem::path(file.path()).filename().string();
}

std::string place_text(const Vec3& place_m) {
  return fmt::format("{:.1f}, {:.1f}, {:.1f}", place_m.x, place_m.y, place_m.z);
}

std::string listener_title(std::size_t index, const Vec3& place_m) {
  return fmt::format("Listener {} at {} m", index + 1, place_text(place_m));
}

std::string value_text(const std::optional<double>& value, int digits) {
  return value ? fmt::format("{:.{}f}", *value, digits) : "-";
}

std::vector<std::string> band_columns(const std::string& first) {
  std::vector<std::string> columns = {first};
  for (std::size_t b = 0; b < kBandCount; ++b) columns.push_back(band_title(b));
  return columns;
}

std::string title_of(const ParameterKind& kind) {
  return kind.unit[0] != 0 ? fmt::format("{} ({})", kind.name, kind.unit) : kind.name;
}

// The just-noticeable difference, in words.
std::string noticeable_text(const ParameterKind& kind) {
  return kind.is_share
             ? fmt::format("{:.0f} %", 100 * kind.noticeable)
             : fmt::format("{:g}{}{}", kind.noticeable, kind.unit[0] != 0 ? " " : "", kind.unit);
}

const ParameterKind& kind_of(const char* name) {
  return *std::find_if(kParameterKinds.begin(), kParameterKinds.end(),
                       [&](const ParameterKind& kind) { return std::string(kind.name) == name; });
}

const char* meaning_of(const std::string& name) {
  if (name == "T30") return "reverberation time";
  if (name == "EDT") return "early decay time";
  if (name == "C80") return "clarity of music";
  if (name == "D50") return "definition of speech";
  return "strength, the level";
}

class ReportWriter {
 public:
  explicit ReportWriter(const ReportContents& contents)
      : contents_(contents),
        room_(contents.measured.meter->room()),
        file_(*room_.file),
        page_("report", "How " + file_.provenance().level + " sounds", setting()),
        areas_(absorbing_areas(room_.mesh, file_.materials())) {}

  std::string write() {
    write_answer();
    write_findings();
    page_.markup(kViewMarkup);
    write_sound();
    write_listeners();
    write_floor();
    write_materials();
    write_file();
    page_.markup("<script type=\"application/json\" id=\"level\">" + json_for_html() +
                 "</script>\n<script>\n" + kViewScript + "</script>\n");
    return page_.html();
  }

 private:
  std::string setting() const {
    const BakeOverview& overview = contents_.overview;
    return fmt::format("{}: {} and {}, made by {}", file_name(file_),
                       counted(overview.emitter_count, "emitter"),
                       counted(overview.secondary, "secondary source"), file_.provenance().tool);
  }

  // "</script>" in a name would end the script.
  std::string json_for_html() const {
    std::string json;
    for (const char c : contents_.view.json)
      json += c == '<' ? std::string("\\u003c") : std::string(1, c);
    return json;
  }

  std::size_t problems() const {
    return static_cast<std::size_t>(std::ranges::count_if(contents_.findings, is_warning));
  }

  void write_answer() {
    const auto& responses = contents_.measured.responses;
    const bool is_crowd = !contents_.measured.meter->excitation().emitter;
    std::string text = described(responses, is_crowd);
    const std::size_t wrong = problems();
    text += wrong == 0 ? " The bake found nothing wrong with the level."
                       : fmt::format(" The bake warns of {}.",
                                     wrong == 1 ? "one thing" : fmt::format("{} things", wrong));
    page_.markup("<p class=\"headline\">" + escaped(text) + "</p>\n");
    std::string facts = "<ul class=\"facts\">";
    const auto fact = [&](const std::string& value, const std::string& words) {
      facts += fmt::format("<li><b>{}</b><span>{}</span></li>", escaped(value), escaped(words));
    };
    for (const char* name : {"T30", "EDT", "C80", "D50", "G"}) {
      if (is_crowd && name != std::string("T30") && name != std::string("G")) continue;
      const ParameterKind& kind = kind_of(name);
      const auto value = middle_value(responses, kind);
      if (!value) continue;
      std::string words = fmt::format("{}, {}", name, meaning_of(name));
      if (contents_.other)
        if (const auto other = middle_value(contents_.other->responses, kind))
          words += fmt::format("; {} in {}", value_text(other, kind.is_share ? 2 : kind.digits - 1),
                               file_name(contents_.other->file()));
      fact(value_text(value, kind.is_share ? 2 : kind.digits - 1) +
               (kind.unit[0] != 0 ? " " + std::string(kind.unit) : ""),
           words);
    }
    if (const auto ratio = bass_ratio(responses))
      fact(fmt::format("{:.2f}", *ratio), "bass ratio: T30 below 350 Hz over that above");
    const double escaped_power = [&] {
      const double emitted = sum_of(file_.statistics().power_emitted);
      return emitted > 0 ? sum_of(file_.statistics().power_escaped) / emitted : 0;
    }();
    fact(fmt::format("{:.1f} %", 100 * escaped_power), "of the power left the level");
    page_.markup(facts + "</ul>\n");
    page_.markup(
        fmt::format("<p class=\"note\">Means over {} and the octaves of 500 Hz and 1 kHz, for an "
                    "impulse from {}.</p>\n",
                    counted(responses.size(), "listener"),
                    escaped(contents_.measured.meter->excitation().words)));
  }

  void write_findings() {
    using Kind = LevelFinding::Kind;
    constexpr std::size_t kShownGaps = 5;
    std::string list = "<ul class=\"findings\" aria-label=\"Findings\">";
    std::size_t gaps = 0, number = 0;
    if (const std::string why = cause_of_decay(contents_.measured.responses, areas_); !why.empty())
      list += "<li><span class=\"kind\">What rings</span><span>" + escaped(why) +
              "</span><span></span></li>";
    for (const LevelFinding& finding : contents_.findings) {
      const std::size_t index = number++;
      if (finding.kind == Kind::kGap && ++gaps > kShownGaps) continue;
      list += fmt::format("<li{}><span class=\"kind\">{}</span><span>{}</span>",
                          is_warning(finding)           ? " class=\"wrong\""
                          : finding.kind == Kind::kFact ? " class=\"fine\""
                                                        : "",
                          title_of(finding.kind), escaped(finding.text));
      list += finding.place_m ? fmt::format(
                                    "<button type=\"button\" data-finding=\"{}\" aria-label=\"Show "
                                    "in the view: {}\">Show in the view</button>",
                                    index, escaped(finding.text))
                              : "<span></span>";
      list += "</li>\n";
    }
    if (const LevelFindings& found = file_.statistics().findings; gaps > kShownGaps)
      list += fmt::format(
          "<li><span class=\"kind\">Thin gap</span><span>and {} more; {} {} in the "
          "view</span><span></span></li>\n",
          found.thin_gaps - kShownGaps, gaps, gaps < found.thin_gaps ? "of them are" : "are");
    if (contents_.other)
      list += "<li><span class=\"kind\">Compared</span><span>" + escaped(comparison()) +
              "</span><span></span></li>\n";
    page_.markup(list + "</ul>\n");
  }

  // "In wood.clamor T30 is 1.14 s, 1.3 just-noticeable differences longer; ..."
  std::string comparison() const {
    std::string text = "In " + file_name(contents_.other->file());
    bool is_first = true;
    for (const char* name : {"T30", "EDT", "C80", "D50", "G"}) {
      const ParameterKind& kind = kind_of(name);
      const auto here = middle_value(contents_.measured.responses, kind),
                 there = middle_value(contents_.other->responses, kind);
      if (!here || !there || !(kind.noticeable_at(*here) > 0)) continue;
      const double steps = (*there - *here) / kind.noticeable_at(*here);
      text += fmt::format("{} {} is {}{} ({:+.1f})", is_first ? "" : ",", name,
                          value_text(there, kind.is_share ? 2 : kind.digits - 1),
                          kind.unit[0] != 0 ? " " + std::string(kind.unit) : "", steps);
      is_first = false;
    }
    return text + "; in brackets the difference from this bake in just-noticeable differences.";
  }

  // Charts of the parameters over frequency, and what listeners differ by.
  void write_sound() {
    page_.heading("What it sounds like");
    const auto& responses = contents_.measured.responses;
    std::string legend = "<p class=\"note\">";
    for (std::size_t i = 0; i < responses.size(); ++i)
      legend += fmt::format("<span class=\"swatch s{}\"></span>listener {}: {} m &emsp;", i % 9,
                            i + 1, place_text(responses[i].listener_m));
    if (contents_.other)
      legend += fmt::format("lines: {}, dashes: {}", escaped(file_name(file_)),
                            escaped(file_name(contents_.other->file())));
    page_.markup(legend + "</p>\n");
    std::vector<Chart> charts;
    for (const char* name : {"T30", "EDT", "C80", "D50", "G"})
      charts.push_back(parameter_chart(kind_of(name)));
    charts.push_back(decay_chart());
    page_.charts(
        charts, 3,
        fmt::format(
            "Room parameters of ISO 3382-1 in octaves{}. Listeners who differ by less than the "
            "grey "
            "band hear the same: it is one just-noticeable difference either way of their mean.",
            contents_.other ? ", dashed those of " + file_name(contents_.other->file()) : ""));
    for (std::size_t i = 0; i < responses.size(); ++i) {
      ReportTable parameters = parameter_table(i, contents_.measured, "");
      parameters.folded = i > 0;
      page_.table(std::move(parameters));
      if (!contents_.other) continue;
      ReportTable differences = difference_table(i);
      differences.folded = i > 0;
      page_.table(std::move(differences));
    }
    page_.table(bake_table());
  }

  Chart parameter_chart(const ParameterKind& kind) const {
    Chart chart{.title = title_of(kind),
                .x_label = "octave (Hz)",
                .y_label = title_of(kind),
                .log_x = true};
    chart.x_ticks.assign(kBandCentres_hz.begin(), kBandCentres_hz.end());
    chart.width = 420;
    chart.height = 290;
    const auto& responses = contents_.measured.responses;
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
    add(contents_.measured, Chart::Series::Look::kLineAndDots);
    if (contents_.other) add(*contents_.other, Chart::Series::Look::kDashes);
    return chart;
  }

  // The bass of the decay against its middle: what a designer mends first.
  Chart decay_chart() const {
    Chart chart{.title = "Decay over frequency",
                .x_label = "octave (Hz)",
                .y_label = "T30 over its mean at 500 Hz and 1 kHz",
                .log_x = true};
    chart.x_ticks.assign(kBandCentres_hz.begin(), kBandCentres_hz.end());
    chart.width = 420;
    chart.height = 290;
    const auto& responses = contents_.measured.responses;
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

  ReportTable parameter_table(std::size_t listener, const MeasuredRoom& measured,
                              const std::string& of) const {
    const RoomResponse& response = measured.responses[listener];
    ReportTable table{"parameters",
                      listener_title(listener, response.listener_m) + of,
                      band_columns("parameter"),
                      {}};
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
  ReportTable difference_table(std::size_t listener) const {
    const RoomResponse& here = contents_.measured.responses[listener];
    const RoomResponse& there = contents_.other->responses[listener];
    ReportTable table{
        "differences",
        fmt::format("{} in {}: difference in just-noticeable differences",
                    listener_title(listener, here.listener_m), file_name(contents_.other->file())),
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
  ReportTable bake_table() const {
    ReportTable table{"acoustics",
                      "What the bake measured while tracing, as clamor inspect prints it",
                      band_columns("acoustics"),
                      {}};
    for (const BandRow& line : acoustic_rows(file_, contents_.overview)) {
      std::vector<ReportTable::Cell> row = {line.title};
      for (std::size_t b = 0; b < kBandCount; ++b) row.emplace_back(line.text(b));
      table.rows.push_back(std::move(row));
    }
    table.folded = true;
    return table;
  }

  void write_listeners() {
    page_.heading("At the listeners");
    const std::size_t sources = contents_.measured.responses[0].sources;
    page_.paragraph(
        fmt::format("An impulse from {}. ", contents_.measured.meter->excitation().words) +
        (sources < file_.source_count() / 2
             ? fmt::format(
                   "Each response is that of {} of the file's {}, a fair sample chosen for the "
                   "place: energies are right on average. --exact takes all.",
                   counted(sources, "source"), grouped(file_.source_count()))
             : "Each response is that of all sources."));
    for (std::size_t i = 0; i < contents_.measured.responses.size(); ++i) write_listener(i);
  }

  void write_listener(std::size_t index) {
    const RoomResponse& response = contents_.measured.responses[index];
    page_.subheading(listener_title(index, response.listener_m));
    if (response.arrivals.empty()) {
      page_.paragraph("Nothing is heard there.");
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
    page_.charts(
        {decay, echogram, waveform}, 3,
        index > 0 ? ""
                  : fmt::format(
                        "Left: Schroeder's backward integral of the energies; a straight line is "
                        "an even decay, a "
                        "knee two rooms in one. Middle: energy at 1 kHz in steps of {:.0f} ms, "
                        "relative to all of it. "
                        "Right: an impulse response with these energies; 1 is the emitter at 1 m.",
                        1e3 * kEchoBin_s));
    page_.table(std::move(decays));
    page_.table(std::move(echoes));
    page_.table(std::move(samples));
  }

  static std::pair<Chart, ReportTable> echogram_of(const RoomResponse& response) {
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
      table.rows.push_back(
          {fmt::format("{:.0f}", to_ms - 1e3 * kEchoBin_s * kPerRow), fmt::format("{:.0f}", to_ms),
           in_row > 0 ? fmt::format("{:.1f}", 10 * std::log10(in_row / all)) : "-"});
      in_row = 0;
    }
    chart.series = {series};
    return {chart, table};
  }

  // Lowest and highest sample of each column of the chart.
  static std::pair<Chart, ReportTable> waveform_of(const RoomResponse& response) {
    Chart chart{
        .title = "Impulse response", .x_label = "time after emission (ms)", .y_label = "pressure"};
    chart.width = 420;
    chart.height = 290;
    const auto first = static_cast<std::size_t>(
        std::max(0.0, response.arrivals.front().time_s - 0.01) * kSampleRate_hz);
    const auto wide = static_cast<std::size_t>(kWaveform_s * kSampleRate_hz);
    const std::vector<float> samples = impulse_response(response.arrivals, first + wide);
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
          samples.begin() + static_cast<std::ptrdiff_t>(first + c * wide / kColumns),
          samples.begin() + static_cast<std::ptrdiff_t>(first + (c + 1) * wide / kColumns));
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

  void write_floor() {
    const FloorMap& map = contents_.map;
    if (map.cells.empty()) return;
    page_.heading("Over the floor");
    page_.markup("<div id=\"floor\"></div>\n");
    std::string text = fmt::format(
        "{} at ear height, {:.2g} m apart; each value from {} chosen for the place, heard in "
        "straight lines.",
        counted(map.cells.size(), "place"), map.step_m, counted(map.sources, "source"));
    if (contents_.map_at_first) {
      text += " At listener 1 that differs from the full measurement by ";
      bool is_first = true;
      for (const char* name : {"T30", "C80", "G"}) {
        const ParameterKind& kind = kind_of(name);
        double squares = 0;
        int count = 0;
        for (std::size_t b = 1; b < 7; ++b) {
          const auto& full = (contents_.measured.responses[0].parameters.*kind.value)[b];
          const auto& quick = (*contents_.map_at_first.*kind.value)[b];
          if (!full || !quick || !(kind.noticeable_at(*full) > 0)) continue;
          squares += std::pow((*quick - *full) / kind.noticeable_at(*full), 2);
          ++count;
        }
        if (count == 0) continue;
        text +=
            fmt::format("{}{:.1f} ({})", is_first ? "" : ", ", std::sqrt(squares / count), name);
        is_first = false;
      }
      text += " just-noticeable differences (root mean square of 125 Hz to 4 kHz).";
    }
    page_.markup("<p class=\"note\">" + escaped(text) + "</p>\n");
  }

  void write_materials() {
    page_.heading("What absorbs the sound");
    if (areas_.empty()) {
      page_.paragraph("The level has no surfaces.");
      return;
    }
    double all_m2 = 0;
    for (const AbsorbingArea& area : areas_) all_m2 += area.area_m2;
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
    for (std::size_t i = 0; i < areas_.size(); ++i) {
      const AbsorbingArea& area = areas_[i];
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
    if (areas_.size() > kShownMaterials) bars.parts.push_back(std::move(rest));
    const std::string caption = fmt::format(
        "The {} of largest area. Right: area times absorption, which is what shortens the decay of "
        "an octave.",
        counted(std::min(areas_.size(), kShownMaterials), "material"));
    page_.markup("<div class=\"row\" style=\"--columns: 2\"><figure>" + to_svg(curves) +
                 "</figure><figure>" + to_svg(bars) + "</figure></div><p class=\"note\">" +
                 escaped(caption) + "</p>\n");
    ReportTable table{"materials",
                      "Materials by area, and the share of sound that they absorb",
                      band_columns("material"),
                      {}};
    table.columns.insert(table.columns.begin() + 1, {"area (m2)", "area (%)"});
    for (const AbsorbingArea& area : areas_) {
      std::vector<ReportTable::Cell> row = {area.name, fmt::format("{:.1f}", area.area_m2),
                                            fmt::format("{:.1f}", 100 * area.area_m2 / all_m2)};
      for (const float absorption : area.absorption)
        row.emplace_back(fmt::format("{:.2f}", absorption));
      table.rows.push_back(std::move(row));
    }
    table.folded = areas_.size() > 12;
    page_.table(std::move(table));
  }

  void write_file() {
    page_.heading("The file");
    const BakeOverview& overview = contents_.overview;
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
    const std::vector<ByteSection> sections = byte_sections(file_);
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
    page_.charts({power, bytes}, 2,
                 "Left: how much of the sound a player knows as it reads deeper. Right: where the "
                 "bytes are.");
    page_.table(std::move(shares));
    page_.table(std::move(sizes));
    ReportTable making{"making", "How it was made", {"what", "how"}, {}};
    for (const MakingLine& line : making_lines(file_, overview))
      making.rows.push_back({std::string(line.title), line.text});
    page_.markup("<div class=\"words\">");
    page_.table(std::move(making));
    page_.markup("</div>");
  }

  const ReportContents& contents_;
  const Room& room_;
  const BakeFile& file_;
  ReportPage page_;
  std::vector<AbsorbingArea> areas_;
};

}  // namespace

std::string report_html(const ReportContents& contents) { return ReportWriter(contents).write(); }

}  // namespace clamor
