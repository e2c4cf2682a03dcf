// report_page.h: what an experiment found: one HTML page with its pictures in it, and each
// table as CSV and JSON.
#pragma once

#include <string>
#include <variant>
#include <vector>

#include "common/result.h"
#include "formats/files/output_target.h"
#include "tools/analysis/chart.h"

namespace clamor {

struct ReportTable {
  using Cell = std::variant<std::string, double>;

  std::string name;                  // of its CSV file and in JSON
  std::string title;                 // above it
  std::vector<std::string> columns;  // as "loudness_db": with units
  std::vector<std::vector<Cell>> rows;
  bool folded = false;  // on the page, shown only when asked for
};

class ReportPage {
 public:
  // `name` names the files: NAME.html, NAME.json, NAME_TABLE.csv.
  ReportPage(std::string name, const std::string& title, const std::string& setting);

  void heading(const std::string& text);
  void paragraph(const std::string& text);
  // Side by side: what the paper says, and what was found here.
  void claim(const std::string& paper, const std::string& ours);
  void chart(const Chart& chart, const std::string& caption);
  // Several in rows of `columns`.
  void charts(const std::vector<Chart>& charts, int columns, const std::string& caption);
  void picture(const std::string& svg, const std::string& caption);
  void table(ReportTable table);

  // An Error where a report of that name could not be written to the folder or would replace one
  // of the inputs. Makes nothing, so that it can be asked before the work begins.
  static Result<void> check_folder(const std::string& folder, const std::string& name,
                                   const InputFiles& inputs);

  // Makes the folder where there is none. The Error names the file that could not be written.
  Result<void> write(const std::string& folder) const;

  const std::vector<ReportTable>& tables() const { return tables_; }

 private:
  std::string name_, title_, setting_, body_;
  std::vector<ReportTable> tables_;
};

}  // namespace clamor
