#include "common/decay_curve.h"

#include <algorithm>
#include <cassert>
#include <cmath>

#include "common/maths.h"

namespace clamor {

namespace {

constexpr double kHeadroom_db = 10;
constexpr int kMinArrivals = 8;

// 10 log10(ratio) with the same bits on every CPU.
double decibels(double ratio) {
  return ratio > 0 ? log2_of(ratio) * (10 / 3.321928094887362) : -1e9;
}

}  // namespace

DecayCurve::DecayCurve(const std::vector<EnergyStep>& steps, double end_s) {
  // Backwards, to add the small energies of the tail before the large ones.
  std::vector<double> yet_to_come(steps.size());
  double last_tenth = 0;
  for (std::size_t i = steps.size(); i-- > 0;) {
    assert(steps[i].energy >= 0);
    assert(i == 0 || steps[i - 1].time_s <= steps[i].time_s);
    energy_ += steps[i].energy;
    yet_to_come[i] = energy_;
    if (steps[i].time_s > 0.9 * end_s) last_tenth = energy_;
  }
  end_db_ = decibels(last_tenth / energy_);

  double start_s = 0;
  for (std::size_t i = 0; i < steps.size(); ++i) {
    if (steps[i].energy <= 0) continue;
    const double at_s = std::max(0.0, steps[i].time_s);
    treads_.push_back({start_s, at_s, decibels(yet_to_come[i] / energy_)});
    start_s = at_s;
  }
}

double DecayCurve::level_db(double time_s) const {
  const auto tread = std::lower_bound(treads_.begin(), treads_.end(), time_s,
                                      [](const Tread& t, double s) { return t.end_s < s; });
  return tread == treads_.end() ? decibels(0) : tread->level_db;
}

// Levels decrease monotonically, so a range is one run of treads.
std::span<const DecayCurve::Tread> DecayCurve::range(double from_db, double to_db) const {
  const auto first = std::lower_bound(treads_.begin(), treads_.end(), from_db,
                                      [](const Tread& t, double db) { return t.level_db > db; });
  const auto last = std::lower_bound(first, treads_.end(), to_db,
                                     [](const Tread& t, double db) { return t.level_db >= db; });
  return {first, last};
}

std::optional<double> DecayCurve::decay_time_s(double from_db, double to_db) const {
  assert(to_db < from_db);
  if (treads_.empty() || end_db_ > to_db - kHeadroom_db) return std::nullopt;
  const std::span<const Tread> treads = range(from_db, to_db);
  if (treads.size() < kMinArrivals) return std::nullopt;

  // Integrals over the range of 1, t, t^2, L and t L, with t from its start.
  double one = 0, t1 = 0, t2 = 0, level = 0, t_level = 0;
  for (const Tread& tread : treads) {
    const double a = tread.start_s - treads[0].start_s, b = tread.end_s - treads[0].start_s;
    const double half_square = (b * b - a * a) / 2;
    one += b - a;
    t1 += half_square;
    t2 += (b * b * b - a * a * a) / 3;
    level += tread.level_db * (b - a);
    t_level += tread.level_db * half_square;
  }
  const double slope_db_per_s = (one * t_level - t1 * level) / (one * t2 - t1 * t1);
  if (!(slope_db_per_s < 0)) return std::nullopt;
  return -60 / slope_db_per_s;
}

std::optional<double> DecayCurve::early_decay_time_s() const {
  constexpr double kRange_db = 10, kMinFall_db = kRange_db / 2;
  const auto decay_s = decay_time_s(0, -kRange_db);
  if (!decay_s) return std::nullopt;
  const std::span<const Tread> treads = range(0, -kRange_db);
  const auto lasting = std::count_if(
      treads.begin(), treads.end(), [](const Tread& tread) { return tread.end_s > tread.start_s; });
  const double fall_db = 60 / *decay_s * (treads.back().end_s - treads.front().start_s);
  if (lasting < kMinArrivals || fall_db < kMinFall_db) return std::nullopt;
  return decay_s;
}

}  // namespace clamor
