// report_page.h: a report as one HTML page with embedded pictures; for experiments each table also
// as CSV and JSON, each picture also as SVG.
//
// Every page that Clamor writes is made here, so that they share one stylesheet
// (tools/report/page/style.css) and one style of charts (chart.h).
#pragma once

#include <concepts>
#include <string>
#include <variant>
#include <vector>

#include "common/result.h"
#include "formats/files/output_target.h"
#include "tools/analysis/chart.h"

namespace clamor {

struct ReportTable {
  // Words, or a number of whatever type.
  struct Cell : std::variant<std::string, double> {
    using Value = std::variant<std::string, double>;
    using Value::Value;
    template <std::integral Count>
    Cell(Count count) : Value(static_cast<double>(count)) {}
  };

  std::string name;                  // in the CSV file name and in JSON
  std::string title;                 // caption above the table
  std::vector<std::string> columns;  // with units, as "loudness_db"
  std::vector<std::vector<Cell>> rows;
  bool folded = false;  // collapsed on the page
};

class ReportPage {
 public:
  // Files are named NAME.html, NAME.json, NAME_TABLE.csv, NAME_1.svg and so on.
  ReportPage(std::string name, const std::string& title, const std::string& setting);

  void heading(const std::string& text);
  void paragraph(const std::string& text);
  // Puts the claim of the paper and the result side by side.
  void claim(const std::string& paper, const std::string& ours);
  void chart(const Chart& chart, const std::string& caption);
  // Several charts in rows of `columns`.
  void charts(const std::vector<Chart>& charts, int columns, const std::string& caption);
  void charts(const std::vector<BarChart>& charts, int columns, const std::string& caption);
  void picture(const std::string& svg, const std::string& caption);
  void subheading(const std::string& text);
  // Markup as it is: text in it must be escaped().
  void markup(const std::string& html);
  void table(ReportTable table);

  // Checks that a report of that name can be written to the folder and would not replace one of the
  // inputs. Creates nothing, so commands call it before the work begins.
  static Result<void> check_folder(const std::string& folder, const std::string& name,
                                   const InputFiles& inputs);

  // Creates the folder if needed. The Error names the file that could not be written.
  Result<void> write(const std::string& folder) const;

  // The whole page, self-contained.
  std::string html() const;

  const std::vector<ReportTable>& tables() const { return tables_; }

 private:
  void figure(const std::vector<std::string>& pictures, int columns, const std::string& caption);

  std::string name_, title_, setting_, body_;
  std::vector<ReportTable> tables_;
  std::vector<std::string> pictures_;  // SVG
};

}  // namespace clamor
