// chart.h: charts as self-contained SVG, which the stylesheet of a page
// (tools/report/page/style.css) adapts to its scheme and font.
#pragma once

#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace clamor {

struct Chart {
  struct Series {
    std::string name = {};                               // shown in the legend
    std::vector<std::pair<double, double>> points = {};  // sorted by x
    enum class Look { kLineAndDots, kLine, kDashes, kThin } look = Look::kLineAndDots;
    int colour = -1;  // palette index, kGrey, or kBand + an octave band; -1: the next colour
  };
  static constexpr int kGrey = 100, kBand = 200;

  // A range of y along x, shaded in the background.
  struct Ribbon {
    struct At {
      double x, low, high;
    };
    std::vector<At> points;  // sorted by x
  };

  // A labelled range of x, shaded in the background.
  struct Zone {
    double from = 0, to = 0;
    std::string label;
  };

  std::string title = {}, x_label = {}, y_label = {};  // including units
  bool log_x = false, log_y = false;
  std::vector<double> x_ticks = {};  // empty: round numbers
  std::optional<std::pair<double, double>> y_range = {};
  std::vector<Series> series = {};
  std::vector<Zone> zones = {};
  std::vector<Ribbon> ribbons = {};
  double width = 760, height = 400;
};

// Points that are not finite, or not positive on a logarithmic axis, are left out.
std::string to_svg(const Chart& chart);

// Columns of stacked bars.
struct BarChart {
  struct Part {
    std::string name;                 // shown in the legend
    std::vector<double> values = {};  // one per column, not negative
    int colour = -1;                  // palette index or Chart::kGrey; -1: the next colour
  };
  std::string title = {}, x_label = {}, y_label = {};  // including units
  std::vector<std::string> columns = {};
  std::vector<Part> parts = {};  // from the bottom
  double width = 760, height = 400;
};
std::string to_svg(const BarChart& chart);

// Escapes & < > " for HTML and SVG.
std::string escaped(const std::string& text);

// An SVG text element; `how` holds further attributes (the default is left-aligned).
std::string svg_text(double x, double y, const std::string& what, const std::string& how = "");

// A number as an axis label: 0.25, 16 384, 3.2.
std::string short_number(double value);

}  // namespace clamor
