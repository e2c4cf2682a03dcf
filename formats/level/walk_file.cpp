#include "formats/level/walk_file.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include <fmt/format.h>

#include "formats/files/json.h"
#include "formats/level/level_origin.h"

namespace clamor {

namespace {

constexpr double kRadians = std::numbers::pi / 180;
constexpr double kLongest_s = 1e7;

// The shorter turn from one angle to another.
double shortest_turn(double from, double to) {
  return std::remainder(to - from, 2 * std::numbers::pi);
}

}  // namespace

Result<Walk> Walk::read(const std::string& path) {
  auto json = read_json(path);
  if (!json.ok()) return json.error();
  shorten_names(*json);
  return parse(*json, path);
}

Result<Walk> Walk::parse(const Json& json, const std::string& path) {
  Walk walk;
  JsonFields fields(json, path);
  walk.loop_ = fields.boolean("loop").value_or(false);
  fields.any("comment");
  const Json* points = fields.any("points");
  if (points == nullptr || points->array() == nullptr || points->array()->empty())
    fields.fail(
        "needs 'points', a list of at least one { \"time_s\": 0, \"position_m\": [0, 1.7, 3] }");
  if (const auto ok = fields.result_without_unknown(); !ok.ok()) return ok.error();

  for (const Json& item : *points->array()) {
    JsonFields values(item, fmt::format("{}: point {}", path, walk.points_.size() + 1));
    const auto time_s = values.number("time_s", 0, kLongest_s);
    const auto position_m = values.vector("position_m", kMaxWorldCoordinate_m);
    if (!time_s) values.fail("'time_s' is missing");
    if (!position_m) values.fail("'position_m' is missing");
    HeadAngles angles;
    angles.yaw_rad = values.number("yaw_deg", -1e6, 1e6).value_or(0) * kRadians;
    angles.pitch_rad = values.number("pitch_deg", -90, 90).value_or(0) * kRadians;
    angles.roll_rad = values.number("roll_deg", -1e6, 1e6).value_or(0) * kRadians;
    const Point point{
        time_s.value_or(0), {position_m.value_or(Vec3{}), Orientation(angles)}, angles};
    if (!walk.points_.empty() && point.time_s < walk.points_.back().time_s)
      values.fail("'time_s' must not be earlier than that of the point before");
    if (const auto ok = values.result_without_unknown(); !ok.ok()) return ok.error();
    walk.points_.push_back(point);
  }
  return walk;
}

Walk Walk::standing(const Listener& listener) {
  Walk walk;
  walk.points_.push_back({0, listener, {}});
  return walk;
}

double Walk::length_s() const { return points_.back().time_s; }

Listener Walk::at(double time_s) const {
  if (loop_ && length_s() > 0) time_s = std::fmod(std::max(time_s, 0.0), length_s());
  const auto after =
      std::upper_bound(points_.begin(), points_.end(), time_s,
                       [](double t, const Point& point) { return t < point.time_s; });
  if (after == points_.begin()) return points_.front().listener;
  if (after == points_.end()) return points_.back().listener;
  const Point &from = *(after - 1), &to = *after;
  const double t = (time_s - from.time_s) / (to.time_s - from.time_s);
  const HeadAngles &a = from.angles, &b = to.angles;
  const Vec3 from_m = from.listener.position_m, to_m = to.listener.position_m;
  return {from_m + t * (to_m - from_m), a.yaw_rad + t * shortest_turn(a.yaw_rad, b.yaw_rad),
          a.pitch_rad + t * (b.pitch_rad - a.pitch_rad),
          a.roll_rad + t * shortest_turn(a.roll_rad, b.roll_rad)};
}

}  // namespace clamor
