#include "tools/analysis/report_page.h"

#include <cerrno>
#include <cstring>
#include <filesystem>
#include <span>

#include <fmt/format.h>
#include <nlohmann/json.hpp>
#include <unistd.h>

#include "common/version.h"
#include "formats/files/atomic_file.h"

namespace clamor {

namespace {

constexpr const char* kHead = R"(<!DOCTYPE html>
<html lang="en"><head><meta charset="utf-8"><title>{0}</title><style>
body {{ font: 15px/1.5 Helvetica, Arial, sans-serif; color: #222; max-width: 1000px; margin: 2em auto; padding: 0 1em; }}
h1 {{ font-size: 24px; margin-bottom: 0; }} h2 {{ font-size: 18px; margin-top: 2em; border-bottom: 1px solid #ddd; }}
.setting {{ color: #666; }}
.claim {{ display: grid; grid-template-columns: 1fr 1fr; gap: 1em; margin: 1em 0; }}
.claim div {{ padding: .6em 1em; border-left: 4px solid #bbb; background: #f7f7f7; }}
.claim div.ours {{ border-color: #0072B2; background: #eef5fa; }}
.claim b {{ display: block; font-size: 12px; text-transform: uppercase; color: #666; }}
figure {{ margin: 1em 0; }} figure svg {{ max-width: 100%; height: auto; }} figcaption {{ color: #555; font-size: 13px; }}
.row {{ display: flex; flex-wrap: wrap; gap: 6px; }}
table {{ border-collapse: collapse; font-size: 13px; margin: .5em 0; }}
th, td {{ padding: 2px 10px; text-align: right; border-bottom: 1px solid #eee; }} th {{ background: #f2f2f2; }}
th:first-child, td:first-child {{ text-align: left; }} summary {{ cursor: pointer; color: #0072B2; }}
</style></head><body>
<h1>{0}</h1><p class="setting">{1}</p>
)";

std::string words(const ReportTable::Cell& cell) {
  if (const auto* text = std::get_if<std::string>(&cell)) return *text;
  return short_number(std::get<double>(cell));
}

// A field as in RFC 4180: in quotes where it has a comma, a quote or a line break.
std::string csv_field(const std::string& text) {
  if (text.find_first_of(",\"\r\n") == std::string::npos) return text;
  std::string quoted = "\"";
  for (const char c : text) quoted += c == '"' ? "\"\"" : std::string(1, c);
  return quoted + '"';
}

std::string to_csv(const ReportTable& table) {
  std::string csv;
  for (const std::string& column : table.columns) csv += (csv.empty() ? "" : ",") + column;
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

std::string to_html(const ReportTable& table) {
  std::string html = "<table><tr>";
  for (const std::string& column : table.columns) html += "<th>" + escaped(column) + "</th>";
  html += "</tr>\n";
  for (const auto& row : table.rows) {
    html += "<tr>";
    for (const auto& cell : row) html += "<td>" + escaped(words(cell)) + "</td>";
    html += "</tr>\n";
  }
  html += "</table>\n";
  if (table.folded)
    return fmt::format("<details><summary>{}</summary>{}</details>\n", escaped(table.title), html);
  return fmt::format("<p><b>{}</b></p>{}", escaped(table.title), html);
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
  body_ += "<figure><div class=\"row\">";
  for (const Chart& chart : charts) {
    pictures_.push_back(to_svg(chart));
    body_ += fmt::format("<div style=\"flex: 0 1 calc({}% - 6px)\">{}</div>", 100 / columns,
                         pictures_.back());
  }
  body_ += "</div><figcaption>" + escaped(caption) + "</figcaption></figure>\n";
}

void ReportPage::picture(const std::string& svg, const std::string& caption) {
  pictures_.push_back(svg);
  body_ += "<figure>" + svg + "<figcaption>" + escaped(caption) + "</figcaption></figure>\n";
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
    return Error(present.string() + ": cannot write here (" + std::strerror(errno) +
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
  const std::string page = fmt::format(fmt::runtime(kHead), escaped(title_), escaped(setting_)) +
                           body_ + "</body></html>\n";
  if (auto written = write_file(base + ".html", page); !written) return written;
  nlohmann::ordered_json json = {
      {"experiment", name_}, {"clamor", kVersion}, {"title", title_}, {"setting", setting_}};
  for (const ReportTable& table : tables_) json["tables"][table.name] = to_json(table);
  if (auto written =
          write_file(base + ".json",
                     json.dump(1, ' ', false, nlohmann::json::error_handler_t::replace) + "\n");
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
