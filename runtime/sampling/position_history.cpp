#include "runtime/sampling/position_history.h"

#include <algorithm>
#include <cassert>
#include <cmath>

#include "runtime/voices/keyframe.h"

namespace clamor {

namespace {

// Rows are kept in three densities, so many of each.
constexpr std::uint64_t kRowsOfADensity = 16, kSparser = 4;
constexpr double kTrail_s = 6.7;  // no more is extrapolated, either
constexpr double kGap = 1.5;      // keyframes without a row in between
constexpr float kCubicOvershoot = 1.25f;

// Seconds before now at which sound left a point that moves in a straight line and was at
// `position_m` so long ago: the earlier solution of a quadratic equation.
double line_age_s(const Vec3& place, const Vec3& position_m, const Vec3& velocity_mps, double age_s,
                  double c) {
  const Vec3 way = place - position_m, mach = velocity_mps / c;
  const double away_m = c * age_s, b = away_m - dot(way, mach), rest = 1 - dot(mach, mach);
  const double under = b * b - rest * (away_m * away_m - dot(way, way));
  return age_s - (b - std::sqrt(std::max(under, 0.0))) / rest / c;
}

}  // namespace

PositionHistory::PositionHistory(std::size_t sources, double speed_of_sound_mps)
    : speed_of_sound_mps_(speed_of_sound_mps),
      origins_(sources),
      fastest2_(sources),
      nearer_(sources, 1.0f) {}

void PositionHistory::push(double time_s) {
  Row row;
  if (!spare_.empty()) {
    row = std::move(spare_.back());
    spare_.pop_back();
  }
  row.time_s = time_s;
  row.number = pushed_++;
  rows_.push_back(std::move(row));
  thin_out();
}

void PositionHistory::thin_out() {
  const auto is_kept = [this](const Row& row) {
    const std::uint64_t age = pushed_ - 1 - row.number;
    std::uint64_t every = 1;
    while (age >= kRowsOfADensity * every) {
      every *= kSparser;
      if (every > kSparser * kSparser || row.number % every != 0) return false;
    }
    return true;
  };
  std::size_t kept = 0;
  for (Row& row : rows_) {
    if (!is_kept(row))
      spare_.push_back(std::move(row));
    else if (Row& to = rows_[kept++]; &to != &row)
      std::swap(to, row);
  }
  rows_.resize(kept);
}

void PositionHistory::record(double time_s, Column x_m, Column y_m, Column z_m) {
  const std::size_t count = x_m.size();
  const bool begins = rows_.empty() || time_s < rows_.back().time_s;
  if (begins) {
    for (Row& row : rows_) spare_.push_back(std::move(row));
    rows_.clear();
  }
  // Nobody asked for a while, because nothing moved. If something did, time ran away.
  if (!rows_.empty() && time_s > rows_.back().time_s + kGap * kKeyframe_s &&
      last_step_s_ < rows_.back().time_s) {
    push(time_s - kKeyframe_s);
    rows_.back().at_m = rows_[rows_.size() - 2].at_m;
  }
  if (rows_.empty() || time_s > rows_.back().time_s) push(time_s);

  Row& row = rows_.back();
  row.at_m.resize(count);
  jumped_.clear();
  const Row* const last = rows_.size() > 1 ? &rows_[rows_.size() - 2] : nullptr;
  const std::size_t known = last == nullptr ? 0 : std::min(count, last->at_m.size());
  const auto per_s =
      static_cast<float>(last == nullptr ? 0 : 1 / (speed_of_sound_mps_ * (time_s - last->time_s)));
  constexpr auto kFastest2 = static_cast<float>(kMaxSourceMach * kMaxSourceMach);
  bool any = false;
  for (std::size_t i = 0; i < known; ++i) {
    const Vec3f now_m(x_m[i], y_m[i], z_m[i]), step = per_s * (now_m - last->at_m[i]);
    row.at_m[i] = now_m;
    const float speed2 = dot(step, step);
    if (speed2 == 0) continue;
    any = true;
    if (!(speed2 <= kFastest2)) {
      jumped_.push_back(static_cast<std::uint32_t>(i));
    } else if (speed2 > fastest2_[i]) {
      fastest2_[i] = speed2;
      const float most = 1 + kCubicOvershoot * std::sqrt(speed2);
      nearer_[i] = most * most;
    }
  }
  for (std::size_t i = known; i < count; ++i) row.at_m[i] = {x_m[i], y_m[i], z_m[i]};
  if (begins)
    for (std::uint32_t i = 0; i < count; ++i) jumped_.push_back(i);
  if (any) last_step_s_ = time_s;
}

void PositionHistory::restart(std::size_t source, const Vec3f& velocity_mps) {
  const Row& row = rows_.back();
  const Vec3f mach = velocity_mps / static_cast<float>(speed_of_sound_mps_);
  const bool too_fast = !(dot(mach, mach) <= static_cast<float>(kMaxSourceMach * kMaxSourceMach));
  origins_[source] = {row.time_s, row.at_m[source], too_fast ? Vec3f(0) : velocity_mps};
  fastest2_[source] = too_fast ? 0 : dot(mach, mach);
  const float most = 1 + kCubicOvershoot * std::sqrt(fastest2_[source]);
  nearer_[source] = most * most;
  if (fastest2_[source] > 0) last_step_s_ = row.time_s;
}

bool PositionHistory::settled() const {
  return rows_.empty() || rows_.back().time_s > last_step_s_ + kTrail_s;
}

PositionHistory::Knot PositionHistory::knot(const Way& way, std::size_t k) const {
  const Origin& origin = origins_[way.source];
  if (k == 0) return {origin.time_s, Vec3(origin.position_m)};
  const Row& row = rows_[way.first_row + k - 1];
  return {row.time_s, Vec3(row.at_m[way.source])};
}

// Metres per second at a knot, from the knots beside it.
Vec3 PositionHistory::slope(const Way& way, std::size_t k) const {
  const Knot here = knot(way, k);
  const auto towards = [&](std::size_t other) {
    const Knot there = knot(way, other);
    return (there.position_m - here.position_m) / (there.time_s - here.time_s);
  };
  if (k == 0) return towards(1);
  if (k == last_knot(way)) return towards(k - 1);
  const double before_s = here.time_s - knot(way, k - 1).time_s;
  const double after_s = knot(way, k + 1).time_s - here.time_s;
  return (after_s * towards(k - 1) + before_s * towards(k + 1)) / (before_s + after_s);
}

// Before the source was there it moved in a straight line.
PositionHistory::Emission PositionHistory::before_all(std::size_t source, const Vec3& place) const {
  const Origin& origin = origins_[source];
  const double now_s = rows_.back().time_s, age_s = now_s - origin.time_s;
  const Vec3 velocity_mps(origin.velocity_mps);
  const double left_s =
      line_age_s(place, Vec3(origin.position_m), velocity_mps, age_s, speed_of_sound_mps_) - age_s;
  if (left_s <= kTrail_s)
    return {Vec3f(Vec3(origin.position_m) - left_s * velocity_mps), origin.velocity_mps};
  return {Vec3f(Vec3(origin.position_m) - kTrail_s * velocity_mps), Vec3f(0)};
}

PositionHistory::Emission PositionHistory::emission(std::size_t source, const Vec3& place) const {
  if (fastest2_[source] == 0) return {rows_.back().at_m[source], Vec3f(0)};
  const double c = speed_of_sound_mps_, now_s = rows_.back().time_s;
  const auto since =
      std::upper_bound(rows_.begin(), rows_.end(), origins_[source].time_s,
                       [](double time_s, const Row& row) { return time_s < row.time_s; });
  const Way path{source, static_cast<std::size_t>(since - rows_.begin())};
  // By how much sound that left it there then is late: below 0, it has passed.
  const auto late_m = [&](const Knot& at) {
    return length(place - at.position_m) - c * (now_s - at.time_s);
  };
  std::size_t passed = 0, not_yet = last_knot(path);
  if (not_yet == 0 || late_m(knot(path, 0)) > 0) return before_all(source, place);
  while (not_yet > passed + 1) {
    const std::size_t middle = (passed + not_yet) / 2;
    (late_m(knot(path, middle)) <= 0 ? passed : not_yet) = middle;
  }
  const Knot from = knot(path, passed), to = knot(path, not_yet);
  const double whole_s = to.time_s - from.time_s;
  const Vec3 from_slope = whole_s * slope(path, passed);
  const Vec3 to_slope = whole_s * slope(path, not_yet);
  const Vec3 step = to.position_m - from.position_m;
  const Vec3 bend2 = 3.0 * step - 2.0 * from_slope - to_slope;
  const Vec3 bend3 = from_slope + to_slope - 2.0 * step;
  const double from_late = late_m(from), to_late = late_m(to);
  double part = to_late > from_late ? -from_late / (to_late - from_late) : 0;
  Vec3 position_m = from.position_m, velocity_mps{};
  for (int i = 0; i < 4; ++i) {  // Newton's iteration
    part = std::clamp(part, 0.0, 1.0);
    position_m = from.position_m + part * (from_slope + part * (bend2 + part * bend3));
    velocity_mps = (from_slope + part * (2.0 * bend2 + 3 * part * bend3)) / whole_s;
    const Vec3 way = place - position_m;
    const double way_m = length(way);
    const double late = way_m - c * (now_s - from.time_s - part * whole_s);
    if (std::abs(late) < 1e-7 || i == 3) break;
    const double closing = way_m > 0 ? dot(way, velocity_mps) / way_m : 0;
    part -= late / (whole_s * (c - closing));
  }
  return {Vec3f(position_m), Vec3f(velocity_mps)};
}

}  // namespace clamor
