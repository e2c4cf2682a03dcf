#include "tools/experiments/room_comparison.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include <fmt/format.h>

namespace clamor {

namespace {

using Value = RoomParameters::Value;

constexpr std::size_t kFirstJudged = 2, kLastJudged = 6;  // 250 Hz to 4 kHz
// After the point. Means of six seeds vary by more than the last digit, as do ParameterKind's.
constexpr int kDigitsOfJnd = 2;

bool is_empty(const Value& values) {
  return std::ranges::none_of(values, [](const auto& value) { return value.has_value(); });
}

std::string unit_of(const ParameterKind& kind) {
  return *kind.unit != '\0' ? fmt::format(" ({})", kind.unit) : "";
}

// Adds a row with a cell for each octave, empty where there is no value.
void add_row(ReportTable& table, std::vector<ReportTable::Cell> row, const Value& values,
             int digits) {
  const double per_one = std::pow(10, digits);
  for (const auto& value : values)
    row.push_back(value ? ReportTable::Cell(std::round(*value * per_one) / per_one)
                        : ReportTable::Cell(std::string()));
  table.rows.push_back(std::move(row));
}

}  // namespace

RoomComparison::RoomComparison(std::span<const RoomFigures> figures,
                               std::span<const std::string> names, std::span<const AtPairs> by_seed)
    : figures_(figures), pair_names_(names), by_seed_(by_seed) {
  for (const RoomFigures& one : figures)
    if (std::ranges::count(names_, one.by) == 0) names_.push_back(one.by);
  for (std::size_t pair = 0; pair < names.size(); ++pair) all_pairs_.push_back(pair);
}

void RoomComparison::add(const ParameterKind& kind, ReportTable& means, std::vector<Chart>& charts,
                         std::string& summary) const {
  const Value measured = mean_by("", kind);
  if (is_empty(measured)) return;
  const auto add_means = [&](const std::string& figure, const Value& values,
                             int digits = kDigitsOfJnd) {
    add_row(means, {kind.name, figure}, values, digits);
  };
  const auto in_jnd = [&](const auto& difference) {
    Value values;
    for (std::size_t b = 0; b < kBandCount; ++b)
      if (const std::optional<double> one = measured[b] ? difference(b) : std::nullopt)
        values[b] = *one / kind.noticeable_at(*measured[b]);
    return values;
  };
  const std::string unit = unit_of(kind);
  Chart chart{.title = kind.name,
              .x_label = "octave band (Hz)",
              .y_label = kind.name + unit,
              .log_x = true,
              .x_ticks = {kBandCentres_hz.begin(), kBandCentres_hz.end()},
              .width = 420,
              .height = 260};
  const auto add_line = [&](const std::string& name, const Value& values, bool is_dashed) {
    using Look = Chart::Series::Look;
    Chart::Series line{.name = name, .look = is_dashed ? Look::kDashes : Look::kLineAndDots};
    for (std::size_t b = 0; b < kBandCount; ++b)
      if (values[b]) line.points.emplace_back(kBandCentres_hz[b], *values[b]);
    chart.series.push_back(std::move(line));
  };

  Value ours, of_seeds, of_pairs;
  for (std::size_t b = 0; b < kBandCount; ++b) {
    const auto of_bakes = over_seeds(pairs_of("", kind, b), kind, b);
    std::vector<double> at_pairs;
    for (const std::size_t pair : all_pairs_)
      if (const auto one = over_seeds({pair}, kind, b)) at_pairs.push_back(one->mean);
    const auto over_pairs = spread_of(at_pairs);
    if (!of_bakes || !measured[b]) continue;
    ours[b] = of_bakes->mean, of_seeds[b] = of_bakes->deviation;
    if (over_pairs) of_pairs[b] = over_pairs->deviation;
  }
  add_means("measured" + unit, measured, kind.digits);
  add_line("measured", measured, false);
  const auto compare = [&](const std::string& name, const Value& values, bool is_dashed) {
    const auto difference = in_jnd([&](std::size_t b) {
      return values[b] ? std::optional(*values[b] - *measured[b]) : std::nullopt;
    });
    add_means(name + unit, values, kind.digits);
    add_means(name + " - measured (JND)", difference);
    add_line(name, values, is_dashed);
    std::vector<double> sizes;
    for (std::size_t b = kFirstJudged; b <= kLastJudged; ++b)
      if (difference[b]) sizes.push_back(std::abs(*difference[b]));
    if (!sizes.empty())
      summary += fmt::format("{}{} of {} {:.2f}", summary.empty() ? "" : ", ", kind.name, name,
                             mean_of(sizes));
  };
  compare("Clamor", ours, false);
  add_means("seeds of Clamor (JND)", in_jnd([&](std::size_t b) { return of_seeds[b]; }));
  add_means("pairs of Clamor (JND)", in_jnd([&](std::size_t b) { return of_pairs[b]; }));
  if (std::ranges::count(figures_, "", &RoomFigures::by) > 1)
    add_means("pairs measured (JND)", in_jnd([&](std::size_t b) {
                return std::optional(spread_of(values_by("", kind, b))->deviation);
              }));
  for (const std::string& name : names_)
    if (!name.empty()) compare(name, mean_by(name, kind), true);
  charts.push_back(std::move(chart));
}

void RoomComparison::add_pair(std::size_t pair, const ParameterKind& kind,
                              ReportTable& table) const {
  const std::string unit = unit_of(kind);
  const std::string name = pair_names_[pair];
  Value ours, of_seeds;
  for (std::size_t b = 0; b < kBandCount; ++b)
    if (const auto of_bakes = over_seeds({pair}, kind, b)) {
      ours[b] = of_bakes->mean;
      of_seeds[b] = of_bakes->deviation / kind.noticeable_at(of_bakes->mean);
    }
  add_row(table, {name, kind.name, "Clamor" + unit}, ours, kind.digits);
  add_row(table, {name, kind.name, "seeds of Clamor (JND)"}, of_seeds, kDigitsOfJnd);
  for (const RoomFigures& one : figures_)
    if (one.pairs == std::vector{pair} && !is_empty(one.values.*kind.value))
      add_row(table, {name, kind.name, (one.by.empty() ? "measured" : one.by) + unit},
              one.values.*kind.value, kind.digits);
}

std::vector<double> RoomComparison::values_by(const std::string& by, const ParameterKind& kind,
                                              std::size_t b) const {
  std::vector<double> values;
  for (const RoomFigures& one : figures_)
    if (const auto& value = (one.values.*kind.value)[b]; one.by == by && value)
      values.push_back(*value);
  return values;
}

Value RoomComparison::mean_by(const std::string& by, const ParameterKind& kind) const {
  Value means;
  for (std::size_t b = 0; b < kBandCount; ++b)
    if (const auto over = spread_of(values_by(by, kind, b))) means[b] = over->mean;
  return means;
}

std::vector<std::size_t> RoomComparison::pairs_of(const std::string& by, const ParameterKind& kind,
                                                  std::size_t b) const {
  std::vector<std::size_t> pairs;
  for (const RoomFigures& one : figures_)
    if (one.by == by && (one.values.*kind.value)[b])
      pairs.insert(pairs.end(), one.pairs.begin(), one.pairs.end());
  return pairs;
}

std::optional<Spread> RoomComparison::over_seeds(const std::vector<std::size_t>& pairs,
                                                 const ParameterKind& kind, std::size_t b) const {
  std::vector<double> means;
  for (const AtPairs& at : by_seed_) {
    std::vector<double> values;
    for (const std::size_t pair : pairs)
      if (const auto& value = (at[pair].*kind.value)[b]) values.push_back(*value);
    if (!values.empty()) means.push_back(mean_of(values));
  }
  return spread_of(means);
}

}  // namespace clamor
