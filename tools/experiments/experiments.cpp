#include "tools/experiments/experiments.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <numeric>

#include <fmt/format.h>

#include "common/sphere.h"
#include "runtime/occlusion/occlusion_geometry.h"
#include "tools/experiments/experiment_scene.h"
#include "tools/strategies/strategies.h"

namespace clamor {

namespace {

std::size_t index_of(const ReportTable& table, const std::string& column) {
  const auto at = std::ranges::find(table.columns, column) - table.columns.begin();
  assert(at < std::ssize(table.columns));
  return static_cast<std::size_t>(at);
}

}  // namespace

Vec3 ExperimentOptions::place_in(const ExperimentScene& scene) const {
  return listener_m.value_or(scene.default_listener_m());
}

Result<std::unique_ptr<ExperimentScene>> ExperimentOptions::open_scene() const {
  return ExperimentScene::open(level, quick ? kQuickSources : 0);
}

std::vector<double> column_of(const ReportTable& table, const std::string& column,
                              const std::string& name) {
  const std::size_t at = index_of(table, column);
  std::vector<double> values;
  for (const auto& row : table.rows)
    if (name.empty() || row[0] == ReportTable::Cell(name))
      values.push_back(std::get<double>(row[at]));
  return values;
}

std::vector<std::string> names_of(const ReportTable& table) {
  std::vector<std::string> names;
  for (const auto& row : table.rows)
    if (const auto& name = std::get<std::string>(row[0]); std::ranges::count(names, name) == 0)
      names.push_back(name);
  return names;
}

std::vector<std::string> octave_columns(std::vector<std::string> first, std::size_t lowest,
                                        std::size_t highest) {
  for (std::size_t b = lowest; b <= highest; ++b)
    first.push_back(fmt::format("{:g}_hz", kBandCentres_hz[b]));
  return first;
}

ReportTable rows_with(ReportTable table, const std::string& column,
                      const ReportTable::Cell& value) {
  const std::size_t at = index_of(table, column);
  std::erase_if(table.rows, [&](const auto& row) { return row[at] != value; });
  return table;
}

std::vector<std::string> plot(Chart& chart, const ReportTable& table, const std::string& x,
                              const std::string& y, double least) {
  std::vector<std::string> without;
  for (const std::string& name : names_of(table)) {
    Chart::Series series{.name = name, .colour = colour_of(name)};
    const auto xs = column_of(table, x, name), ys = column_of(table, y, name);
    for (std::size_t i = 0; i < xs.size(); ++i)
      if (ys[i] > least) series.points.emplace_back(xs[i], ys[i]);
    if (series.points.empty())
      without.push_back(name);
    else
      chart.series.push_back(std::move(series));
  }
  return without;
}

void plot_curve(Chart& chart, const std::string& name, const std::vector<double>& xs,
                const std::function<double(double)>& y) {
  Chart::Series series{name, {}, Chart::Series::Look::kDashes, Chart::kGrey};
  for (const double x : xs) series.points.emplace_back(x, y(x));
  chart.series.push_back(std::move(series));
}

std::string range_text(const std::vector<double>& values, int digits) {
  if (values.empty()) return "nothing";
  const auto [min, max] = std::minmax_element(values.begin(), values.end());
  const std::string low = fmt::format("{:.{}f}", *min, digits),
                    high = fmt::format("{:.{}f}", *max, digits);
  return low == high ? low : low + " to " + high;
}

std::string listed(const std::vector<std::string>& names) {
  std::string text;
  for (std::size_t i = 0; i < names.size(); ++i)
    text += (i == 0 ? "" : i + 1 == names.size() ? " and " : ", ") + names[i];
  return text;
}

std::string left_out_text(const std::vector<std::string>& names, const std::string& why) {
  return names.empty() ? "" : " Left out, because they " + why + ": " + listed(names) + ".";
}

double mean_of(const std::vector<double>& values) {
  return std::accumulate(values.begin(), values.end(), 0.0) / static_cast<double>(values.size());
}

std::optional<Spread> spread_of(const std::vector<double>& values) {
  if (values.empty()) return std::nullopt;
  Spread spread;
  const auto n = static_cast<double>(values.size());
  for (const double value : values) spread.mean += value / n;
  for (const double value : values)
    spread.deviation += (value - spread.mean) * (value - spread.mean);
  spread.deviation = n > 1 ? std::sqrt(spread.deviation / (n - 1)) : 0;
  return spread;
}

double level_db(double part, double whole) {
  return part > 0 ? 10 * std::log10(part / whole) : -20;
}

std::optional<double> fitted_exponent(const std::vector<double>& x, const std::vector<double>& y) {
  assert(x.size() == y.size());
  double sum_x = 0, sum_y = 0, sum_xx = 0, sum_xy = 0;
  const auto n = static_cast<double>(x.size());
  for (std::size_t i = 0; i < x.size(); ++i) {
    if (!(x[i] > 0) || !(y[i] > 0)) return std::nullopt;
    const double log_x = std::log(x[i]), log_y = std::log(y[i]);
    sum_x += log_x, sum_y += log_y, sum_xx += log_x * log_x, sum_xy += log_x * log_y;
  }
  const double spread = n * sum_xx - sum_x * sum_x;
  if (x.size() < 2 || !(spread > 1e-12)) return std::nullopt;
  return (n * sum_xy - sum_x * sum_y) / spread;
}

int colour_of(const std::string& strategy) {
  for (std::size_t i = 0; i < kStrategies.size(); ++i)
    if (kStrategies[i].name == strategy) return static_cast<int>(i);
  return Chart::kGrey;
}

bool is_clear(const OcclusionGeometry& surfaces, const Vec3& place_m, double clearance_m) {
  constexpr std::uint32_t kDirections = 64;
  for (std::uint32_t d = 0; d < kDirections; ++d)
    if (!surfaces.is_free(Vec3f(place_m),
                          Vec3f(place_m + clearance_m * spread_direction(d, kDirections))))
      return false;
  return true;
}

double quantile(std::vector<double> values, double share) {
  if (values.empty()) return 0;
  const auto at = static_cast<std::size_t>(share * static_cast<double>(values.size() - 1));
  std::nth_element(values.begin(), values.begin() + static_cast<std::ptrdiff_t>(at), values.end());
  return values[at];
}

std::string at_every_k_except(std::span<const WorseThanPaper> worse) {
  std::string words = "at every k";
  for (const WorseThanPaper& one : worse)
    words += fmt::format("{} {} ({:.2f}, the best of the paper's {:.2f})",
                         &one == &worse.front()  ? " but"
                         : &one == &worse.back() ? " and"
                                                 : ",",
                         one.k, one.ours, one.theirs);
  return words;
}

std::vector<std::size_t> sample_sizes(const ExperimentScene& scene, std::size_t max_k) {
  std::vector<std::size_t> sizes;
  for (std::size_t k = 32; k <= max_k && 2 * k <= scene.size(); k *= 2) sizes.push_back(k);
  return sizes;
}

}  // namespace clamor
