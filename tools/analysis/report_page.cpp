#include "tools/analysis/report_page.h"

#include <cerrno>
#include <cstring>
#include <filesystem>
#include <span>

#include <fmt/format.h>
#include <nlohmann/json.hpp>
#include <unistd.h>

#include "common/printable.h"
#include "common/system_reason.h"
#include "common/version.h"
#include "embedded_page.h"
#include "formats/files/atomic_file.h"

namespace clamor {

namespace {

constexpr const char* kHead = R"(<!DOCTYPE html>
<html lang="en"><head><meta charset="utf-8"><meta name="viewport" content="width=device-width, initial-scale=1">
<meta name="color-scheme" content="light dark"><title>{0}</title>
<style>
{2}</style></head><body>
<header><h1>{0}</h1><p class="setting">{1}</p></header>
<main>
)";

std::string words(const ReportTable::Cell& cell) {
  if (const auto* text = std::get_if<std::string>(&cell)) return *text;
  return short_number(std::get<double>(cell));
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

// A folded table has its title above the fold, others have a caption.
std::string to_html(const ReportTable& table) {
  std::string html = "<div class=\"table\"><table>";
  html += fmt::format("<caption{}>{}</caption>", table.folded ? " class=\"skip\"" : "",
                      escaped(table.title));
  html += "<thead><tr>";
  for (const std::string& column : table.columns)
    html += "<th scope=\"col\">" + escaped(column) + "</th>";
  html += "</tr></thead><tbody>\n";
  for (const auto& row : table.rows) {
    html += "<tr>";
    for (std::size_t c = 0; c < row.size(); ++c)
      html += fmt::format("<{0}{1}>{2}</{0}>", c == 0 ? "th" : "td", c == 0 ? " scope=\"row\"" : "",
                          escaped(words(row[c])));
    html += "</tr>\n";
  }
  html += "</tbody></table></div>\n";
  if (!table.folded) return html;
  return fmt::format("<details><summary>{}</summary>{}</details>\n", escaped(table.title), html);
}

nlohmann::ordered_json to_json(const ReportTable& table) {
  auto json = nlohmann::ordered_json::array();
  for (const auto& row : table.rows) {
    nlohmann::ordered_json one;
    for (std::size_t c = 0; c < row.size(); ++c)
      std::visit([&](const auto& value) { one[table.columns[c]] = value; }, row[c]);
    json.push_back(std::move(one));
  }
  return json;
}

Result<void> write_file(const std::string& path, const std::string& content) {
  auto file = AtomicFile::create(path);
  if (!file.ok()) return file.error();
  if (auto written = file->write(std::as_bytes(std::span(content))); !written.ok()) return written;
  return file->commit();
}

}  // namespace

ReportPage::ReportPage(std::string name, const std::string& title, const std::string& setting)
    : name_(std::move(name)), title_(title), setting_(setting) {}

void ReportPage::heading(const std::string& text) { body_ += "<h2>" + escaped(text) + "</h2>\n"; }

void ReportPage::paragraph(const std::string& text) { body_ += "<p>" + escaped(text) + "</p>\n"; }

void ReportPage::claim(const std::string& paper, const std::string& ours) {
  body_ += fmt::format(
      "<div class=\"claim\"><div><b>The paper</b>{}</div><div class=\"ours\"><b>Here</b>{}</div>"
      "</div>\n",
      escaped(paper), escaped(ours));
}

void ReportPage::chart(const Chart& chart, const std::string& caption) {
  charts({chart}, 1, caption);
}

void ReportPage::charts(const std::vector<Chart>& charts, int columns, const std::string& caption) {
  std::vector<std::string> pictures;
  for (const Chart& chart : charts) pictures.push_back(to_svg(chart));
  figure(pictures, columns, caption);
}

void ReportPage::charts(const std::vector<BarChart>& charts, int columns,
                        const std::string& caption) {
  std::vector<std::string> pictures;
  for (const BarChart& chart : charts) pictures.push_back(to_svg(chart));
  figure(pictures, columns, caption);
}

void ReportPage::figure(const std::vector<std::string>& pictures, int columns,
                        const std::string& caption) {
  body_ += fmt::format("<figure><div class=\"row\" style=\"--columns: {}\">", columns);
  for (const std::string& picture : pictures) {
    pictures_.push_back(picture);
    body_ += "<div>" + picture + "</div>";
  }
  body_ += "</div>";
  if (!caption.empty()) body_ += "<figcaption>" + escaped(caption) + "</figcaption>";
  body_ += "</figure>\n";
}

void ReportPage::picture(const std::string& svg, const std::string& caption) {
  pictures_.push_back(svg);
  body_ += "<figure>" + svg + "<figcaption>" + escaped(caption) + "</figcaption></figure>\n";
}

void ReportPage::subheading(const std::string& text) {
  body_ += "<h3>" + escaped(text) + "</h3>\n";
}

void ReportPage::markup(const std::string& html) { body_ += html; }

std::string ReportPage::html() const {
  return fmt::format(fmt::runtime(kHead), escaped(title_), escaped(setting_), kPageStyle) + body_ +
         "</main></body></html>\n";
}

void ReportPage::table(ReportTable table) {
  body_ += to_html(table);
  tables_.push_back(std::move(table));
}

Result<void> ReportPage::check_folder(const std::string& folder, const std::string& name,
                                      const InputFiles& inputs) {
  namespace fs = std::filesystem;
  if (folder.empty()) return Error("the folder's name is empty; name a folder for the report");
  std::error_code problem;
  fs::path present = fs::absolute(folder, problem);
  while (!problem && !fs::exists(present, problem) && present.has_relative_path())
    present = present.parent_path();
  if (!fs::is_directory(present, problem))
    return Error(present.string() + ": is not a folder, and a report is several files; name a " +
                 "folder for them");
  if (::access(present.c_str(), W_OK | X_OK) != 0)
    return Error(present.string() + ": cannot write here (" + system_reason(errno) +
                 "); choose a place you may write to");
  for (fs::directory_iterator file(folder, problem), end; !problem && file != end;
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
  std::filesystem::create_directories(folder, failed);
  if (failed)
    return Error("cannot be made a folder: " + failed.message() + ". Name another with -o.")
        .in(folder);
  const std::string base = folder + "/" + name_;
  if (auto written = write_file(base + ".html", html()); !written) return written;
  nlohmann::ordered_json json = {
      {"experiment", name_}, {"clamor", kVersion}, {"title", title_}, {"setting", setting_}};
  for (const ReportTable& table : tables_) json["tables"][table.name] = to_json(table);
  if (auto written = write_file(
          base + ".json",
          printable_json(json.dump(1, ' ', false, nlohmann::json::error_handler_t::replace)) +
              "\n");
      !written)
    return written;
  for (const ReportTable& table : tables_)
    if (auto written = write_file(base + "_" + table.name + ".csv", to_csv(table)); !written)
      return written;
  for (std::size_t i = 0; i < pictures_.size(); ++i)
    if (auto written = write_file(fmt::format("{}_{}.svg", base, i + 1), pictures_[i]); !written)
      return written;
  return {};
}

}  // namespace clamor
