// chart.h: lines over axes, as a picture in SVG that needs nothing else.
#pragma once

#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace clamor {

struct Chart {
  struct Series {
    std::string name = {};                               // in the legend
    std::vector<std::pair<double, double>> points = {};  // by ascending x
    enum class Look { kLineAndDots, kLine, kDashes, kThin } look = Look::kLineAndDots;
    int colour = -1;  // of the palette; by turns if it is not given; kGrey
  };
  static constexpr int kGrey = 100;

  // A range of x that means something.
  struct Zone {
    double from = 0, to = 0;
    std::string label;
  };

  std::string title = {}, x_label = {}, y_label = {};  // with units
  bool log_x = false, log_y = false;
  std::vector<double> x_ticks = {};  // unset: round numbers
  std::optional<std::pair<double, double>> y_range = {};
  std::vector<Series> series = {};
  std::vector<Zone> zones = {};
  double width = 760, height = 400;
};

// Points that are not finite, or not above zero on a logarithmic axis, are left out.
std::string to_svg(const Chart& chart);

// & < > " as HTML and SVG want them.
std::string escaped(const std::string& text);

// A line of words in an SVG, from its left end unless `how` (attributes) says else.
std::string svg_text(double x, double y, const std::string& what, const std::string& how = "");

// What a person writes on an axis: 0.25, 16 384, 3.2.
std::string short_number(double value);

}  // namespace clamor
