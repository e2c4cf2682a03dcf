#include "runtime/sampling/part_script.h"

#include <algorithm>
#include <utility>

#include "common/listener.h"
#include "common/text.h"
#include "formats/files/json.h"
#include "formats/level/acoustic_values.h"
#include "formats/level/level_origin.h"
#include "runtime/occlusion/part_shape.h"

namespace clamor {

namespace {

constexpr double kMaxPoint_s = 1e7, kMaxAngle_deg = 1e6, kMaxBox_m = 1e4;
constexpr double kRadians = 0.017453292519943295;

const MovablePart* find(std::span<const MovablePart> parts, const std::string& name) {
  const auto found = std::ranges::find(parts, name, &MovablePart::name);
  return found == parts.end() ? nullptr : &*found;
}

}  // namespace

Result<std::vector<PartScript::Point>> PartScript::parse_points(const Json& json,
                                                                const std::string& where) {
  std::vector<Point> points;
  for (const Json& item : *json.array()) {
    JsonFields values(item, where + ": point " + std::to_string(points.size() + 1));
    Point point;
    const auto time_s = values.number("time_s", 0, kMaxPoint_s);
    if (!time_s) values.fail("'time_s' is missing");
    point.time_s = time_s.value_or(0);
    if (!points.empty() && point.time_s < points.back().time_s)
      values.fail("'time_s' must not be earlier than that of the point before");
    point.position_m = values.vector("position_m", kMaxWorldCoordinate_m);
    if (!point.position_m && !points.empty()) point.position_m = points.back().position_m;
    const auto angle_rad = [&](const char* key) {
      return values.number(key, -kMaxAngle_deg, kMaxAngle_deg).value_or(0) * kRadians;
    };
    HeadAngles angles;
    angles.yaw_rad = angle_rad("yaw_deg");
    angles.pitch_rad = angle_rad("pitch_deg");
    angles.roll_rad = angle_rad("roll_deg");
    point.turn = Orientation(angles).rotation();
    if (const auto ok = values.result_without_unknown(); !ok.ok()) return ok.error();
    points.push_back(point);
  }
  return points;
}

Result<PartScript::Part> PartScript::parse_part(const Json& json, const std::string& where) {
  JsonFields fields(json, where);
  Part part;
  part.name = fields.string("name").value_or("");
  const auto box_m = fields.vector("box_m", kMaxBox_m);
  const auto transmission = bands_member(fields, "transmission", 0, 1);
  const Json* const points = fields.any("points");
  if (part.name.empty()) fields.fail("'name' is missing");
  if (transmission && !box_m)
    fields.fail(
        "'transmission' is for boxes, which have 'box_m'; parts of the level have materials");
  if (points == nullptr || points->array() == nullptr || points->array()->empty())
    fields.fail("needs 'points', a list of at least one { \"time_s\": 0, \"yaw_deg\": 90 }");
  if (box_m && !(box_m->x >= 1e-3 && box_m->y >= 1e-3 && box_m->z >= 1e-3))
    fields.fail("'box_m' must have three edges of at least a millimetre");
  if (const auto ok = fields.result_without_unknown(); !ok.ok()) return ok.error();
  auto parsed = parse_points(*points, where);
  if (!parsed.ok()) return parsed.error();
  part.points = std::move(*parsed);
  if (!box_m) return part;
  if (!part.points.front().position_m)
    return Error(where + ": point 1: 'position_m' is missing; a box has no place at rest.");
  Material material = mirror_material();
  material.transmission = transmission.value_or(Bands{});
  for (std::size_t b = 0; b < kBandCount; ++b)
    material.absorption[b] = std::max(material.absorption[b], material.transmission[b]);
  const auto shape = PartShape::make(box_mesh(0.5 * *box_m, 0), std::span(&material, 1));
  if (!shape.ok()) return shape.error().in(where);
  part.box = *shape;
  return part;
}

Result<PartScript> PartScript::parse(const Json& json, const std::string& where) {
  PartScript script;
  if (json.array() == nullptr || json.array()->empty())
    return Error(
        where +
        ": 'parts' must be a list of at least one, [ { \"name\": \"Door\", \"points\": ... } ].");
  for (const Json& item : *json.array()) {
    auto part = parse_part(item, where + ": part " + std::to_string(script.parts_.size() + 1));
    if (!part.ok()) return part.error();
    script.parts_.push_back(std::move(*part));
  }
  return script;
}

bool PartScript::adds_parts() const {
  return std::ranges::any_of(parts_, [](const Part& part) { return part.box != nullptr; });
}

Result<void> PartScript::check(std::span<const MovablePart> of_level) const {
  for (const Part& part : parts_) {
    if (part.box != nullptr || find(of_level, part.name) != nullptr) continue;
    std::vector<std::string> names;
    for (const MovablePart& known : of_level) names.push_back(known.name);
    return Error("the script moves " + in_quotes(part.name) + ", but the level has " +
                 (names.empty() ? "no movable part; mark its node as movable and bake again."
                                : "no movable part of this name; the nearest is " +
                                      in_quotes(nearest_name(part.name, names)) + "."));
  }
  return {};
}

PartPose PartScript::Part::at(double time_s, const PartPose& rest) const {
  const auto after =
      std::upper_bound(points.begin(), points.end(), time_s,
                       [](double t, const Point& point) { return t < point.time_s; });
  const Point& from = after == points.begin() ? points.front() : *(after - 1);
  const Point& to = after == points.end() ? points.back() : *after;
  const double span_s = to.time_s - from.time_s;
  const double t = span_s > 0 ? std::clamp((time_s - from.time_s) / span_s, 0.0, 1.0) : 0;
  const Vec3 from_m = from.position_m.value_or(rest.position_m),
             to_m = to.position_m.value_or(rest.position_m);
  const Quaternion turn = glm::slerp(from.turn, to.turn, t);
  return {from_m + t * (to_m - from_m), Rotation(turn * Quaternion(rest.rotation)), rest.scale};
}

Result<void> PartScript::apply(const Stage& stage, double time_s) {
  if (stage.parts == nullptr || empty()) return {};
  for (Part& part : parts_) {
    if (part.box != nullptr) {
      const PartPose pose = part.at(time_s, {});
      if (part.handle.generation == 0) {
        const auto added = stage.parts->add(part.box, pose);
        if (!added.ok()) return added.error();
        part.handle = *added;
      } else if (const auto ok = stage.parts->move(part.handle, pose); !ok.ok()) {
        return ok;
      }
      continue;
    }
    const MovablePart* const known = find(stage.of_level, part.name);
    if (known == nullptr) continue;
    const auto index = static_cast<std::size_t>(known - stage.of_level.data());
    if (const auto ok = stage.parts->move(
            stage.handles[index], part.at(time_s, in_world(known->rest_pose, stage.origin_m)));
        !ok.ok())
      return ok;
  }
  return {};
}

}  // namespace clamor
