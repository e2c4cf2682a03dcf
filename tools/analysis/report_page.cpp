#include "tools/analysis/report_page.h"

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <span>
#include <string_view>

#include <fmt/format.h>

#include "common/platform/system_file.h"
#include "common/printable.h"
#include "common/system_reason.h"
#include "common/utf8_path.h"
#include "common/version.h"
#include "embedded_page.h"
#include "formats/files/atomic_file.h"

namespace clamor {

namespace {

constexpr const char* kPage = R"(<!DOCTYPE html>
<html lang="en"><head><meta charset="utf-8"><meta name="viewport" content="width=device-width, initial-scale=1">
<meta name="color-scheme" content="light dark"><title>{}</title>
<style>
{}</style></head><body>
<noscript>The scripts of this page draw it. Allow them, or read the figures in the JSON below.</noscript>
<script type="application/json" id="contents">{}</script>
<script>
{}{}</script></body></html>
)";

// Replaces what printable() replaces, escapes included, because the page shows the strings. "<" is
// escaped, since "</script>" in a name would end the script.
std::string json_for_html(const OrderedJson& document) {
  const std::string json = document.dump(-1, ' ', false, OrderedJson::error_handler_t::replace);
  std::string text;
  for (std::size_t i = 0; i < json.size(); ++i) {
    if (json[i] == '<') {
      text += "\\u003c";
    } else if (json[i] != '\\' || i + 1 == json.size()) {
      text += json[i];
    } else if (const char kind = json[++i]; std::string_view("bfnrtu").find(kind) < 6) {
      text += '?';
      if (kind == 'u') i += 4;
    } else {
      text += {'\\', kind};
    }
  }
  return printable(text);
}

std::string escaped(const std::string& text) {
  std::string result;
  for (const char c : printable(text))
    result += c == '<' ? "&lt;" : c == '&' ? "&amp;" : std::string(1, c);
  return result;
}

OrderedJson to_json(const Chart& chart) {
  constexpr const char* kLooks[] = {"dots", "line", "dashes", "thin"};
  OrderedJson json = {{"title", chart.title},           {"x_label", chart.x_label},
                      {"y_label", chart.y_label},       {"log_x", chart.log_x},
                      {"log_y", chart.log_y},           {"x_ticks", chart.x_ticks},
                      {"width", chart.width},           {"height", chart.height},
                      {"series", OrderedJson::array()}, {"zones", OrderedJson::array()}};
  if (chart.y_range) json["y_range"] = *chart.y_range;
  for (const Chart::Series& series : chart.series) {
    json["series"].push_back({{"name", series.name},
                              {"look", kLooks[static_cast<std::size_t>(series.look)]},
                              {"points", series.points}});
    if (series.colour == Chart::kGrey)
      json["series"].back()["colour"] = "grey";
    else if (series.colour >= 0)
      json["series"].back()["colour"] = fmt::format("s{}", series.colour % 9);
  }
  for (const Chart::Zone& zone : chart.zones)
    json["zones"].push_back({{"from", zone.from}, {"to", zone.to}, {"label", zone.label}});
  return json;
}

// A field as in RFC 4180: in quotes where it has a comma or a quote.
std::string csv_field(const std::string& raw) {
  const std::string text = printable(raw);
  if (text.find_first_of(",\"") == std::string::npos) return text;
  std::string quoted = "\"";
  for (const char c : text) quoted += c == '"' ? "\"\"" : std::string(1, c);
  return quoted + '"';
}

std::string to_csv(const ReportTable& table) {
  std::string csv;
  for (const std::string& column : table.columns)
    csv += (csv.empty() ? "" : ",") + csv_field(column);
  csv += '\n';
  for (const auto& row : table.rows) {
    for (std::size_t c = 0; c < row.size(); ++c) {
      if (c > 0) csv += ',';
      if (const auto* number = std::get_if<double>(&row[c]))
        csv += fmt::format("{:.7g}", *number);
      else
        csv += csv_field(std::get<std::string>(row[c]));
    }
    csv += '\n';
  }
  return csv;
}

// A cell, which may hold text or a number.
OrderedJson to_json(const ReportTable::Cell& cell) {
  return std::visit([](const auto& value) { return OrderedJson(value); }, cell);
}

OrderedJson to_json(const ReportTable& table) {
  auto json = OrderedJson::array();
  for (const auto& row : table.rows) {
    OrderedJson one;
    for (std::size_t c = 0; c < row.size(); ++c) one[table.columns[c]] = to_json(row[c]);
    json.push_back(std::move(one));
  }
  return json;
}

}  // namespace

std::string page_of_document(const OrderedJson& document, const std::string& scripts) {
  return fmt::format(fmt::runtime(kPage), escaped(document["title"]), kPageStyle,
                     json_for_html(document), scripts, kPageScript);
}

ReportPage::ReportPage(std::string name, const std::string& title, const std::string& setting)
    : name_(std::move(name)),
      document_({{"title", title}, {"setting", setting}, {"blocks", OrderedJson::array()}}) {}

void ReportPage::heading(const std::string& text) {
  document_["blocks"].push_back({{"heading", text}});
}

void ReportPage::paragraph(const std::string& text) {
  document_["blocks"].push_back({{"paragraph", text}});
}

void ReportPage::claim(const std::string& paper, const std::string& ours) {
  document_["blocks"].push_back({{"claim", {{"paper", paper}, {"ours", ours}}}});
}

void ReportPage::chart(const Chart& chart, const std::string& caption) {
  charts({chart}, 1, caption);
}

void ReportPage::charts(const std::vector<Chart>& charts, int columns, const std::string& caption) {
  auto list = OrderedJson::array();
  for (const Chart& chart : charts) list.push_back(to_json(chart));
  document_["blocks"].push_back(
      {{"charts", {{"list", list}, {"columns", columns}, {"caption", caption}}}});
}

void ReportPage::spectrogram(const Spectrogram& heard, const std::string& title,
                             const std::string& caption) {
  auto levels_db = OrderedJson::array();
  for (const auto& powers : heard.power) {
    auto column = OrderedJson::array();
    for (const double power : powers)
      column.push_back(std::round(100 * std::log10(std::max(power, 1e-20))) / 10);
    levels_db.push_back(std::move(column));
  }
  const OrderedJson chart = {{"title", title},
                             {"column_s", heard.column_s},
                             {"length_s", heard.length_s},
                             {"levels_db", levels_db}};
  document_["blocks"].push_back(
      {{"charts", {{"list", OrderedJson::array({chart})}, {"columns", 1}, {"caption", caption}}}});
}

void ReportPage::table(ReportTable table) {
  auto rows = OrderedJson::array();
  for (const auto& row : table.rows) {
    auto cells = OrderedJson::array();
    for (const ReportTable::Cell& cell : row) cells.push_back(to_json(cell));
    rows.push_back(std::move(cells));
  }
  document_["blocks"].push_back({{"table",
                                  {{"title", table.title},
                                   {"columns", table.columns},
                                   {"rows", rows},
                                   {"folded", table.folded}}}});
  tables_.push_back(std::move(table));
}

Result<void> ReportPage::check_folder(const std::string& folder, const std::string& name,
                                      const InputFiles& inputs) {
  namespace fs = std::filesystem;
  if (folder.empty()) return Error("the folder's name is empty; name a folder for the report");
  std::error_code problem;
  fs::path present = fs::absolute(path_of(folder), problem);
  while (!problem && !fs::exists(present, problem) && present.has_relative_path())
    present = present.parent_path();
  if (!fs::is_directory(present, problem))
    return Error(present.string() + ": is not a folder, and a report is several files; name a " +
                 "folder for them");
  if (!may_write_in_folder(present.string()))
    return Error(present.string() + ": cannot write here (" + system_reason(errno) +
                 "); choose a place you may write to");
  for (fs::directory_iterator file(path_of(folder), problem), end; !problem && file != end;
       file.increment(problem)) {
    const std::string file_name = file->path().filename().string();
    if (!file_name.starts_with(name + ".") && !file_name.starts_with(name + "_")) continue;
    if (auto target = OutputTarget::find(file->path().string(), inputs); !target.ok())
      return target.error();
  }
  return {};
}

Result<void> ReportPage::write(const std::string& folder) const {
  std::error_code failed;
  std::filesystem::create_directories(path_of(folder), failed);
  if (failed)
    return Error("cannot be made a folder: " + failed.message() + ". Name another with -o.")
        .in(folder);
  const std::string base = folder + "/" + name_;
  if (auto written = write_file(base + ".html", page_of_document(document_, "")); !written)
    return written;
  OrderedJson json = {{"experiment", name_},
                      {"clamor", kVersion},
                      {"title", document_["title"]},
                      {"setting", document_["setting"]}};
  for (const ReportTable& table : tables_) json["tables"][table.name] = to_json(table);
  if (auto written = write_file(
          base + ".json",
          printable_json(json.dump(1, ' ', false, OrderedJson::error_handler_t::replace)) + "\n");
      !written)
    return written;
  for (const ReportTable& table : tables_)
    if (auto written = write_file(base + "_" + table.name + ".csv", to_csv(table)); !written)
      return written;
  return {};
}

}  // namespace clamor
