#include "runtime/sampling/position_history.h"

#include <algorithm>
#include <cassert>
#include <cmath>

#include "runtime/voices/keyframe.h"

namespace clamor {

namespace {

// Three densities of rows: every row, every fourth, every sixteenth; 16 rows of each.
constexpr std::uint64_t kRowsPerDensity = 16, kThinning = 4;
constexpr double kHistory_s = 6.7;      // also the longest extrapolation
constexpr double kGap_keyframes = 1.5;  // a longer one between rows means that nothing moved
// Speed of the spline between two rows over the mean speed there, at most.
constexpr float kSplineOvershoot = 1.25f;
// Newton's iteration for the emission ends at this error.
constexpr double kMaxEmissionError_m = 1e-7;

// Seconds before now at which sound left a point that moves in a straight line and was at
// `position_m` `age_s` seconds ago: the earlier solution of a quadratic equation.
double straight_emission_age_s(const Vec3& place, const Vec3& position_m, const Vec3& velocity_mps,
                               double age_s, double c) {
  const Vec3 path_m = place - position_m, mach = velocity_mps / c;
  const double sound_m = c * age_s, b = sound_m - dot(path_m, mach), rest = 1 - dot(mach, mach);
  const double discriminant = b * b - rest * (sound_m * sound_m - dot(path_m, path_m));
  return age_s - (b - std::sqrt(std::max(discriminant, 0.0))) / rest / c;
}

}  // namespace

PositionHistory::PositionHistory(std::size_t sources, double speed_of_sound_mps)
    : speed_of_sound_mps_(speed_of_sound_mps),
      origins_(sources),
      max_mach2_(sources),
      max_distance_ratio2_(sources, 1.0f) {}

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
    while (age >= kRowsPerDensity * every) {
      every *= kThinning;
      if (every > kThinning * kThinning || row.number % every != 0) return false;
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
  // A gap after a row at rest means that nothing moved until one keyframe ago. A gap after motion
  // means that keyframes were skipped.
  if (!rows_.empty() && time_s > rows_.back().time_s + kGap_keyframes * kKeyframe_s &&
      last_motion_s_ < rows_.back().time_s) {
    push(time_s - kKeyframe_s);
    rows_.back().positions_m = rows_[rows_.size() - 2].positions_m;
  }
  if (rows_.empty() || time_s > rows_.back().time_s) push(time_s);

  Row& row = rows_.back();
  row.positions_m.resize(count);
  teleported_.clear();
  const Row* const last = rows_.size() > 1 ? &rows_[rows_.size() - 2] : nullptr;
  const std::size_t known = last == nullptr ? 0 : std::min(count, last->positions_m.size());
  const auto per_s =
      static_cast<float>(last == nullptr ? 0 : 1 / (speed_of_sound_mps_ * (time_s - last->time_s)));
  constexpr auto kMaxMach2 = static_cast<float>(kMaxSourceMach * kMaxSourceMach);
  bool any = false;
  for (std::size_t i = 0; i < known; ++i) {
    const Vec3f now_m(x_m[i], y_m[i], z_m[i]), step = per_s * (now_m - last->positions_m[i]);
    row.positions_m[i] = now_m;
    const float mach2 = dot(step, step);
    if (mach2 == 0) continue;
    any = true;
    if (!(mach2 <= kMaxMach2)) {
      teleported_.push_back(static_cast<std::uint32_t>(i));
    } else if (mach2 > max_mach2_[i]) {
      max_mach2_[i] = mach2;
      const float max_ratio = 1 + kSplineOvershoot * std::sqrt(mach2);
      max_distance_ratio2_[i] = max_ratio * max_ratio;
    }
  }
  for (std::size_t i = known; i < count; ++i) row.positions_m[i] = {x_m[i], y_m[i], z_m[i]};
  if (begins)
    for (std::uint32_t i = 0; i < count; ++i) teleported_.push_back(i);
  if (any) last_motion_s_ = time_s;
}

void PositionHistory::restart(std::size_t source, const Vec3f& velocity_mps) {
  const Row& row = rows_.back();
  const Vec3f mach = velocity_mps / static_cast<float>(speed_of_sound_mps_);
  const bool too_fast = !(dot(mach, mach) <= static_cast<float>(kMaxSourceMach * kMaxSourceMach));
  origins_[source] = {row.time_s, row.positions_m[source], too_fast ? Vec3f(0) : velocity_mps};
  max_mach2_[source] = too_fast ? 0 : dot(mach, mach);
  const float max_ratio = 1 + kSplineOvershoot * std::sqrt(max_mach2_[source]);
  max_distance_ratio2_[source] = max_ratio * max_ratio;
  if (max_mach2_[source] > 0) last_motion_s_ = row.time_s;
}

bool PositionHistory::settled() const {
  return rows_.empty() || rows_.back().time_s > last_motion_s_ + kHistory_s;
}

PositionHistory::Knot PositionHistory::knot(const Path& path, std::size_t k) const {
  const Origin& origin = origins_[path.source];
  if (k == 0) return {origin.time_s, Vec3(origin.position_m)};
  const Row& row = rows_[path.first_row + k - 1];
  return {row.time_s, Vec3(row.positions_m[path.source])};
}

// Velocity at a knot, from the knots beside it.
Vec3 PositionHistory::slope(const Path& path, std::size_t k) const {
  const Knot here = knot(path, k);
  const auto towards = [&](std::size_t other) {
    const Knot there = knot(path, other);
    return (there.position_m - here.position_m) / (there.time_s - here.time_s);
  };
  if (k == 0) return towards(1);
  if (k == last_knot(path)) return towards(k - 1);
  const double before_s = here.time_s - knot(path, k - 1).time_s;
  const double after_s = knot(path, k + 1).time_s - here.time_s;
  return (after_s * towards(k - 1) + before_s * towards(k + 1)) / (before_s + after_s);
}

// The emission from before the source was added, when it moved in a straight line.
PositionHistory::Emission PositionHistory::emission_before_origin(std::size_t source,
                                                                  const Vec3& place) const {
  const Origin& origin = origins_[source];
  const double now_s = rows_.back().time_s, age_s = now_s - origin.time_s;
  const Vec3 velocity_mps(origin.velocity_mps);
  const double left_s = straight_emission_age_s(place, Vec3(origin.position_m), velocity_mps, age_s,
                                                speed_of_sound_mps_) -
                        age_s;
  if (left_s <= kHistory_s)
    return {Vec3f(Vec3(origin.position_m) - left_s * velocity_mps), origin.velocity_mps};
  return {Vec3f(Vec3(origin.position_m) - kHistory_s * velocity_mps), Vec3f(0)};
}

PositionHistory::Emission PositionHistory::emission(std::size_t source, const Vec3& place) const {
  if (max_mach2_[source] == 0) return {rows_.back().positions_m[source], Vec3f(0)};
  const double c = speed_of_sound_mps_, now_s = rows_.back().time_s;
  const auto since =
      std::upper_bound(rows_.begin(), rows_.end(), origins_[source].time_s,
                       [](double time_s, const Row& row) { return time_s < row.time_s; });
  const Path path{source, static_cast<std::size_t>(since - rows_.begin())};
  // Distance that sound which left at a knot has still to go; negative once it has passed.
  const auto remaining_m = [&](const Knot& at) {
    return length(place - at.position_m) - c * (now_s - at.time_s);
  };
  std::size_t passed = 0, not_yet = last_knot(path);
  if (not_yet == 0 || remaining_m(knot(path, 0)) > 0) return emission_before_origin(source, place);
  while (not_yet > passed + 1) {
    const std::size_t middle = (passed + not_yet) / 2;
    (remaining_m(knot(path, middle)) <= 0 ? passed : not_yet) = middle;
  }
  const Knot from = knot(path, passed), to = knot(path, not_yet);
  const double whole_s = to.time_s - from.time_s;
  const Vec3 from_slope = whole_s * slope(path, passed);
  const Vec3 to_slope = whole_s * slope(path, not_yet);
  const Vec3 step = to.position_m - from.position_m;
  const Vec3 bend2 = 3.0 * step - 2.0 * from_slope - to_slope;
  const Vec3 bend3 = from_slope + to_slope - 2.0 * step;
  const double from_left_m = remaining_m(from), to_left_m = remaining_m(to);
  double part = to_left_m > from_left_m ? -from_left_m / (to_left_m - from_left_m) : 0;
  Vec3 position_m = from.position_m, velocity_mps{};
  for (int i = 0; i < 4; ++i) {  // Newton's iteration
    part = std::clamp(part, 0.0, 1.0);
    position_m = from.position_m + part * (from_slope + part * (bend2 + part * bend3));
    velocity_mps = (from_slope + part * (2.0 * bend2 + 3 * part * bend3)) / whole_s;
    const Vec3 path_m = place - position_m;
    const double distance_m = length(path_m);
    const double left_m = distance_m - c * (now_s - from.time_s - part * whole_s);
    if (std::abs(left_m) < kMaxEmissionError_m || i == 3) break;
    const double approach_mps = distance_m > 0 ? dot(path_m, velocity_mps) / distance_m : 0;
    part -= left_m / (whole_s * (c - approach_mps));
  }
  return {Vec3f(position_m), Vec3f(velocity_mps)};
}

}  // namespace clamor
