#include "tools/analysis/chart.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include <fmt/format.h>

#include "common/printable.h"

namespace clamor {

namespace {

// A palette for colour-blind readers (M. Okabe, K. Ito. Color Universal Design, 2008).
constexpr std::array<const char*, 9> kPalette = {"#D55E00", "#0072B2", "#009E73",
                                                 "#CC79A7", "#56B4E9", "#E69F00",
                                                 "#7A4FBF", "#8C6D31", "#444444"};

constexpr double kChartLeft = 74, kChartTop = 40, kChartBottom = 56, kChartRight = 18;

// Width of a legend with these names: letters of 11 px are 6 px wide on average.
double legend_px(std::size_t longest_name) {
  return std::min(190.0, 52 + 6 * static_cast<double>(longest_name));
}

struct Axis {
  double low = 0, high = 1;
  bool log = false;
  double from_px = 0, to_px = 1;

  double at(double value) const {
    const double t =
        log ? std::log(value / low) / std::log(high / low) : (value - low) / (high - low);
    return from_px + t * (to_px - from_px);
  }
  bool shows(double value) const { return std::isfinite(value) && (!log || value > 0); }
};

std::vector<double> round_ticks(const Axis& axis) {
  std::vector<double> ticks;
  if (axis.log) {
    const double decades = std::log10(axis.high / axis.low);
    for (double power = std::floor(std::log10(axis.low)); power <= std::log10(axis.high); ++power)
      for (const double digit : {1.0, 2.0, 5.0}) {
        const double tick = digit * std::pow(10.0, power);
        if (decades > 3 && digit != 1) continue;
        if (tick >= axis.low * 0.999 && tick <= axis.high * 1.001) ticks.push_back(tick);
      }
    return ticks;
  }
  const double rough = (axis.high - axis.low) / 6;
  const double power = std::pow(10.0, std::floor(std::log10(rough)));
  double step = power;
  for (const double digit : {1.0, 2.0, 5.0, 10.0})
    if (digit * power <= rough * 1.2) step = digit * power;
  for (double i = std::ceil(axis.low / step - 1e-9); i * step <= axis.high + step * 1e-9; ++i)
    ticks.push_back(i == 0 ? 0 : i * step);
  return ticks;
}

Axis axis_over(std::vector<double> values, bool log, bool with_margin) {
  Axis axis;
  axis.log = log;
  std::erase_if(values, [&](double v) { return !axis.shows(v); });
  if (values.empty()) return {1, 2, log};
  axis.low = *std::min_element(values.begin(), values.end());
  axis.high = *std::max_element(values.begin(), values.end());
  if (log) {
    if (axis.high / axis.low < 1.1) axis.low /= 1.5, axis.high *= 1.5;
    if (with_margin) axis.low /= 1.15, axis.high *= 1.15;
  } else {
    if (axis.high - axis.low < 1e-9) axis.low -= 0.5, axis.high += 0.5;
    const double margin = with_margin ? 0.06 * (axis.high - axis.low) : 0;
    axis.low -= margin;
    axis.high += margin;
  }
  return axis;
}

std::string line(double x1, double y1, double x2, double y2, const std::string& how) {
  return fmt::format("<line x1=\"{:.1f}\" y1=\"{:.1f}\" x2=\"{:.1f}\" y2=\"{:.1f}\" {}/>\n", x1, y1,
                     x2, y2, how);
}

// A colour of a series: its value in a file of its own, and its class on a page.
struct Ink {
  std::string colour, name;
};

// Octave bands have a scale of their own, from low to high.
constexpr std::array<const char*, 8> kBandColours = {"#5b2a86", "#4053a8", "#2f7fb8", "#1f9a93",
                                                     "#4aa84f", "#94a722", "#cf8d1a", "#d4572a"};

Ink ink_of(int colour) {
  if (colour == Chart::kGrey) return {"#888", "grey"};
  if (colour >= Chart::kBand) {
    const auto band = static_cast<std::size_t>(colour - Chart::kBand) % kBandColours.size();
    return {kBandColours[band], "b" + std::to_string(band)};
  }
  const std::size_t index = static_cast<std::size_t>(colour) % kPalette.size();
  return {kPalette[index], "s" + std::to_string(index)};
}

std::string drawn(const Chart::Series& series, const Axis& x, const Axis& y, const Ink& ink) {
  using Look = Chart::Series::Look;
  std::string path, dots;
  for (const auto& [px, py] : series.points) {
    if (!x.shows(px) || !y.shows(py)) continue;
    const double at_x = x.at(px), at_y = std::clamp(y.at(py), y.to_px - 2, y.from_px + 2);
    path += fmt::format("{}{:.1f} {:.1f}", path.empty() ? "M" : " L", at_x, at_y);
    if (series.look == Look::kLineAndDots)
      dots += fmt::format(
          "<circle cx=\"{:.1f}\" cy=\"{:.1f}\" r=\"3\" fill=\"{}\" class=\"{} dot\"/>\n", at_x,
          at_y, ink.colour, ink.name);
  }
  if (path.empty()) return "";
  return fmt::format(
             "<path d=\"{}\" fill=\"none\" stroke=\"{}\" class=\"{} line\" stroke-width=\"{}\"{} "
             "stroke-linejoin=\"round\"/>\n",
             path, ink.colour, ink.name, series.look == Look::kThin ? 0.8 : 1.8,
             series.look == Look::kDashes ? " stroke-dasharray=\"6 4\"" : "") +
         dots;
}

std::string draw_zones(const Chart& chart, const Axis& x, const Axis& y) {
  std::string svg;
  for (const auto& zone : chart.zones) {
    const double from = std::clamp(x.at(zone.from), x.from_px, x.to_px);
    const double to = std::clamp(x.at(zone.to), x.from_px, x.to_px);
    if (!(to > from)) continue;  // outside the axis
    svg += fmt::format(
        "<rect x=\"{:.1f}\" y=\"{:.1f}\" width=\"{:.1f}\" height=\"{:.1f}\" fill=\"#f3f0e6\" "
        "stroke=\"#fff\" class=\"zone\"/>\n",
        from, y.to_px, to - from, y.from_px - y.to_px);
    // Letters are about half as wide as high; a label that does not fit would overprint the next.
    if (5.5 * static_cast<double>(zone.label.size()) < to - from)
      svg +=
          svg_text((from + to) / 2, y.to_px + 14, zone.label,
                   "text-anchor=\"middle\" font-size=\"11\" font-style=\"italic\" fill=\"#776\"");
  }
  return svg;
}

std::string draw_ribbons(const Chart& chart, const Axis& x, const Axis& y) {
  std::string svg;
  for (const Chart::Ribbon& ribbon : chart.ribbons) {
    std::string path;
    const auto go_to = [&](double at_x, double at_y) {
      path += fmt::format("{}{:.1f} {:.1f}", path.empty() ? "M" : " L", x.at(at_x),
                          std::clamp(y.at(at_y), y.to_px, y.from_px));
    };
    for (const auto& at : ribbon.points) go_to(at.x, at.high);
    for (std::size_t i = ribbon.points.size(); i-- > 0;)
      go_to(ribbon.points[i].x, ribbon.points[i].low);
    if (!path.empty())
      svg += fmt::format("<path d=\"{} Z\" fill=\"#e9e9e4\" class=\"ribbon\"/>\n", path);
  }
  return svg;
}

// The frame of a chart: its paper and its title.
std::string svg_head(const std::string& title, double width, double height) {
  return fmt::format(
             "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {0} {1}\" width=\"{0}\" "
             "height=\"{1}\" font-family=\"Helvetica, Arial, sans-serif\" font-size=\"12\" "
             "fill=\"#333\" class=\"chart\" role=\"img\" aria-label=\"{2}\">\n<rect width=\"{0}\" "
             "height=\"{1}\" fill=\"#fff\" class=\"paper\"/>\n",
             width, height, escaped(title)) +
         svg_text(kChartLeft, 24, title,
                  "font-size=\"14\" font-weight=\"bold\" fill=\"#111\" class=\"title\"");
}

std::string axis_titles(const std::string& x_label, const std::string& y_label, double middle_x,
                        double middle_y, double bottom) {
  return svg_text(middle_x, bottom, x_label, "text-anchor=\"middle\"") +
         fmt::format(
             "<text transform=\"translate(18 {:.1f}) rotate(-90)\" "
             "text-anchor=\"middle\">{}</text>\n",
             middle_y, escaped(y_label));
}

std::string draw_axes(const Chart& chart, const Axis& x, const Axis& y) {
  std::string svg;
  for (const double tick : chart.x_ticks.empty() ? round_ticks(x) : chart.x_ticks) {
    svg += line(x.at(tick), y.from_px, x.at(tick), y.to_px, "stroke=\"#e4e4e4\" class=\"grid\"");
    svg += svg_text(x.at(tick), y.from_px + 18, short_number(tick), "text-anchor=\"middle\"");
  }
  for (const double tick : round_ticks(y)) {
    svg += line(x.from_px, y.at(tick), x.to_px, y.at(tick), "stroke=\"#e4e4e4\" class=\"grid\"");
    svg += svg_text(x.from_px - 8, y.at(tick) + 4, short_number(tick), "text-anchor=\"end\"");
  }
  if (!y.log && y.low < 0 && y.high > 0)
    svg += line(x.from_px, y.at(0), x.to_px, y.at(0), "stroke=\"#999\" class=\"axis\"");
  svg += line(x.from_px, y.from_px, x.to_px, y.from_px, "stroke=\"#333\" class=\"axis\"");
  svg += line(x.from_px, y.from_px, x.from_px, y.to_px, "stroke=\"#333\" class=\"axis\"");
  return svg + axis_titles(chart.x_label, chart.y_label, (x.from_px + x.to_px) / 2,
                           (y.from_px + y.to_px) / 2, chart.height - 16);
}

// Draws all series, and a legend if at least two have names.
std::string draw_series(const Chart& chart, const Axis& x, const Axis& y, bool with_legend) {
  std::string svg;
  double legend_y = y.to_px + 10;
  std::size_t turn = 0;
  for (const auto& series : chart.series) {
    const int wanted = series.colour >= 0 ? series.colour : static_cast<int>(turn++);
    const Ink ink = ink_of(wanted);
    svg += drawn(series, x, y, ink);
    if (!with_legend || series.name.empty()) continue;
    svg +=
        line(x.to_px + 14, legend_y, x.to_px + 38, legend_y,
             fmt::format(
                 "stroke=\"{}\" class=\"{} line\" stroke-width=\"2\"{}", ink.colour, ink.name,
                 series.look == Chart::Series::Look::kDashes ? " stroke-dasharray=\"6 4\"" : ""));
    svg += svg_text(x.to_px + 44, legend_y + 4, series.name, "font-size=\"11\"");
    legend_y += 18;
  }
  return svg;
}

}  // namespace

std::string escaped(const std::string& text) {
  std::string result;
  for (const char c : printable(text, Lines::kMany)) {
    if (c == '&')
      result += "&amp;";
    else if (c == '<')
      result += "&lt;";
    else if (c == '>')
      result += "&gt;";
    else if (c == '"')
      result += "&quot;";
    else
      result += c;
  }
  return result;
}

std::string svg_text(double x, double y, const std::string& what, const std::string& how) {
  return fmt::format("<text x=\"{:.1f}\" y=\"{:.1f}\" {}>{}</text>\n", x, y, how, escaped(what));
}

std::string short_number(double value) {
  if (!std::isfinite(value)) return "-";
  if (std::abs(value) >= 10000 && value == std::round(value)) {
    const auto whole = static_cast<long long>(value);
    if (std::abs(whole) < 1000000)
      return fmt::format("{} {:03}", whole / 1000, std::abs(whole) % 1000);
  }
  return fmt::format("{:.4g}", value);
}

std::string to_svg(const Chart& chart) {
  std::vector<double> xs, ys;
  std::size_t named = 0, longest = 0;
  for (const auto& series : chart.series) {
    named += !series.name.empty();
    longest = std::max(longest, series.name.size());
    for (const auto& [x, y] : series.points) {
      xs.push_back(x);
      ys.push_back(y);
    }
  }
  for (const auto& ribbon : chart.ribbons)
    for (const auto& at : ribbon.points) ys.insert(ys.end(), {at.low, at.high});
  const double legend = named > 1 ? legend_px(longest) : 0;
  Axis x = axis_over(xs, chart.log_x, chart.log_x), y = axis_over(ys, chart.log_y, true);
  if (chart.y_range) std::tie(y.low, y.high) = *chart.y_range;
  x.from_px = kChartLeft;
  x.to_px = chart.width - kChartRight - legend;
  y.from_px = chart.height - kChartBottom;
  y.to_px = kChartTop;

  std::string svg = svg_head(chart.title, chart.width, chart.height);
  svg += draw_zones(chart, x, y);
  svg += draw_ribbons(chart, x, y);
  svg += draw_axes(chart, x, y);
  svg += draw_series(chart, x, y, named > 1);
  return svg + "</svg>\n";
}

std::string to_svg(const BarChart& chart) {
  std::vector<double> totals(chart.columns.size(), 0);
  for (const auto& part : chart.parts)
    for (std::size_t c = 0; c < totals.size(); ++c) totals[c] += part.values[c];
  Axis y;
  y.high = totals.empty() ? 1 : *std::max_element(totals.begin(), totals.end());
  if (!(y.high > 0)) y.high = 1;
  y.from_px = chart.height - kChartBottom;
  y.to_px = kChartTop;
  std::size_t longest = 0;
  for (const auto& part : chart.parts) longest = std::max(longest, part.name.size());
  const double right =
      chart.width - kChartRight - (chart.parts.size() > 1 ? legend_px(longest) : 0);
  const double step =
      (right - kChartLeft) / static_cast<double>(std::max<std::size_t>(1, chart.columns.size()));
  std::string svg = svg_head(chart.title, chart.width, chart.height);
  for (const double tick : round_ticks(y)) {
    svg += line(kChartLeft, y.at(tick), right, y.at(tick), "stroke=\"#e4e4e4\" class=\"grid\"");
    svg += svg_text(kChartLeft - 8, y.at(tick) + 4, short_number(tick), "text-anchor=\"end\"");
  }
  for (std::size_t c = 0; c < chart.columns.size(); ++c)
    svg += svg_text(kChartLeft + (static_cast<double>(c) + 0.5) * step, y.from_px + 18,
                    chart.columns[c], "text-anchor=\"middle\"");
  std::vector<double> below(totals.size(), 0);
  double legend_y = y.to_px + 10 + 18 * static_cast<double>(chart.parts.size() - 1);
  for (std::size_t p = 0; p < chart.parts.size(); ++p) {
    const auto& part = chart.parts[p];
    const Ink ink = ink_of(part.colour >= 0 ? part.colour : static_cast<int>(p));
    const std::string fill = fmt::format("fill=\"{}\" class=\"{} bar\"", ink.colour, ink.name);
    for (std::size_t c = 0; c < totals.size(); ++c) {
      const double low = below[c], high = below[c] += part.values[c];
      if (!(y.at(low) - y.at(high) > 0.05)) continue;
      svg +=
          fmt::format("<rect x=\"{:.1f}\" y=\"{:.1f}\" width=\"{:.1f}\" height=\"{:.1f}\" {}/>\n",
                      kChartLeft + (static_cast<double>(c) + 0.17) * step, y.at(high), 0.66 * step,
                      y.at(low) - y.at(high), fill);
    }
    if (chart.parts.size() < 2) continue;
    svg += fmt::format("<rect x=\"{:.1f}\" y=\"{:.1f}\" width=\"12\" height=\"12\" {}/>\n",
                       right + 16, legend_y - 6, fill);
    svg += svg_text(right + 34, legend_y + 4, part.name, "font-size=\"11\"");
    legend_y -= 18;  // the legend is in the order of the stack
  }
  svg += line(kChartLeft, y.from_px, right, y.from_px, "stroke=\"#333\" class=\"axis\"");
  return svg +
         axis_titles(chart.x_label, chart.y_label, (kChartLeft + right) / 2,
                     (y.from_px + y.to_px) / 2, chart.height - 16) +
         "</svg>\n";
}

}  // namespace clamor
