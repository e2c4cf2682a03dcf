// report_page.h: a report as one HTML page; for experiments each table also as CSV and JSON.
//
// C++ makes the document of a page, as JSON, and the page's scripts draw it (tools/report/page), so
// that all pages share one stylesheet and one style of charts.
#pragma once

#include <concepts>
#include <optional>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "common/result.h"
#include "formats/files/output_target.h"
#include "tools/analysis/json_values.h"
#include "tools/analysis/spectrogram.h"

namespace clamor {

// A self-contained page that draws a document by its scripts, and by those that all pages have.
std::string page_of_document(const OrderedJson& document, const std::string& scripts);

// Points that are not finite, or not positive on a logarithmic axis, are left out.
struct Chart {
  struct Series {
    std::string name = {};                               // shown in the legend
    std::vector<std::pair<double, double>> points = {};  // sorted by x
    enum class Look { kLineAndDots, kLine, kDashes, kThin } look = Look::kLineAndDots;
    int colour = -1;  // palette index or kGrey; -1: the next colour
  };
  static constexpr int kGrey = 100;

  // A labelled range of x, shaded in the background.
  struct Zone {
    double from = 0, to = 0;
    std::string label;
  };

  std::string title = {}, x_label = {}, y_label = {};  // including units
  bool log_x = false, log_y = false;
  std::vector<double> x_ticks = {};  // those between the points; empty: round numbers
  std::optional<std::pair<double, double>> y_range = {};
  std::vector<Series> series = {};
  std::vector<Zone> zones = {};
  double width = 760, height = 400;
};

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
  // Files are named NAME.html, NAME.json and NAME_TABLE.csv.
  ReportPage(std::string name, const std::string& title, const std::string& setting);

  void heading(const std::string& text);
  void paragraph(const std::string& text);
  // Puts the claim of the paper and the result side by side.
  void claim(const std::string& paper, const std::string& ours);
  void chart(const Chart& chart, const std::string& caption);
  // Several charts in rows of `columns`.
  void charts(const std::vector<Chart>& charts, int columns, const std::string& caption);
  // In colours that cover 60 dB below the loudest value.
  void spectrogram(const Spectrogram& heard, const std::string& title, const std::string& caption);
  void table(ReportTable table);

  // Checks that a report of that name can be written to the folder and would not replace one of the
  // inputs. Creates nothing, so commands call it before the work begins.
  static Result<void> check_folder(const std::string& folder, const std::string& name,
                                   const InputFiles& inputs);

  // Creates the folder if needed. The Error names the file that could not be written.
  Result<void> write(const std::string& folder) const;

  const std::vector<ReportTable>& tables() const { return tables_; }

 private:
  std::string name_;
  OrderedJson document_;  // title, setting, and blocks from top to bottom
  std::vector<ReportTable> tables_;
};

}  // namespace clamor
