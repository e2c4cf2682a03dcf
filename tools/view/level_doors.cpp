#include "tools/view/level_doors.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "common/bounds.h"
#include "formats/bake_file/baked_portals.h"
#include "tools/view/level_shapes.h"

namespace clamor {

namespace {

constexpr double kMotion_s = 0.6;  // of a whole motion
constexpr double kTurn_deg = 90;
constexpr double kSide = 0.25;  // of a part's width: a pivot further from its middle is a hinge

// The nearest of this name; null without one.
const LevelDoors::Door* nearest(const std::vector<LevelDoors::Door>& doors, const std::string& name,
                                const Vec3& place_m) {
  const LevelDoors::Door* found = nullptr;
  for (const LevelDoors::Door& door : doors)
    if (door.name == name &&
        (found == nullptr || length(door.place_m - place_m) < length(found->place_m - place_m)))
      found = &door;
  return found;
}

}  // namespace

PartMotion guessed_motion(const MovablePart& part) {
  const Matrix axes = part.rest_pose.scale * glm::mat3_cast(Quaternion(part.rest_pose.rotation));
  const auto [low_m, high_m] =
      bounds_of(part.mesh.vertices_m, [&](const Vec3f& vertex) { return axes * Vec3(vertex); });
  const Vec3 size_m = high_m - low_m, middle_m = (low_m + high_m) / 2.0;
  const double width_m = std::max(size_m.x, size_m.z);
  if (std::hypot(middle_m.x, middle_m.z) > kSide * width_m) return {kTurn_deg, Vec3(0)};
  // Along its own wider side, so that a door in a slanted wall stays in it.
  const Boundsf own = bounds_of(part.mesh);
  const Vec3f own_size_m = own.high_m - own.low_m;
  Vec3 along_m(0);
  for (int axis = 0; axis < 3; ++axis) {
    const Vec3 side_m = axes[axis] * static_cast<double>(own_size_m[axis]);
    if (std::hypot(side_m.x, side_m.z) > std::hypot(along_m.x, along_m.z)) along_m = side_m;
  }
  return {0, along_m};
}

PartPose moved(const PartPose& rest, const PartMotion& motion, double share) {
  const Quaternion turn =
      glm::angleAxis(share * motion.turn_deg * std::numbers::pi / 180, Vec3(0, 1, 0));
  PartPose pose = rest;
  pose.position_m += share * motion.shift_m;
  pose.rotation = Rotation(glm::normalize(turn * Quaternion(rest.rotation)));
  return pose;
}

void LevelDoors::update(std::span<const MovablePart> parts, std::span<const Portal> portals,
                        const Vec3& origin_m) {
  const auto door = [&](const std::vector<Door>& known, Door fresh) {
    const Door* const same = nearest(known, fresh.name, fresh.place_m);
    if (same == nullptr) return fresh;
    Door kept = *same;
    kept.place_m = fresh.place_m;
    return kept;
  };
  std::vector<Door> next_parts, next_portals;
  for (const MovablePart& part : parts)
    next_parts.push_back(door(
        parts_, {part.name, part.rest_pose.position_m + origin_m, 0, 0, guessed_motion(part)}));
  for (const Portal& portal : portals)
    next_portals.push_back(door(portals_, {portal.name, portal.centre_m + origin_m, 1, 1}));
  parts_ = std::move(next_parts);
  portals_ = std::move(next_portals);
  told_parts_.clear();
  told_portals_.clear();
}

bool LevelDoors::advance(double seconds) {
  // A door in motion does not jump.
  const double step = seconds / kMotion_s;
  for (std::vector<Door>* const doors : {&parts_, &portals_})
    for (Door& door : *doors) door.share += std::clamp(door.target - door.share, -step, step);
  if (parts_ == told_parts_ && portals_ == told_portals_) return false;
  told_parts_ = parts_;
  told_portals_ = portals_;
  return true;
}

PartPose LevelDoors::pose_of(const MovablePart& part, const Vec3& origin_m) const {
  const Door* const known = nearest(parts_, part.name, part.rest_pose.position_m + origin_m);
  return known == nullptr ? part.rest_pose : moved(part.rest_pose, known->motion, known->share);
}

std::vector<float> LevelDoors::openness_of(std::span<const Portal> portals,
                                           const Vec3& origin_m) const {
  std::vector<float> openness;
  for (const Portal& portal : portals) {
    const Door* const known = nearest(portals_, portal.name, portal.centre_m + origin_m);
    openness.push_back(!portal.parts.empty() ? kOpenedByParts
                       : known == nullptr    ? 1.0f
                                             : static_cast<float>(known->share));
  }
  return openness;
}

namespace {

constexpr double kReach_m = 8, kMaxSide_m = 6, kMaxThickness_m = 0.6;
constexpr double kStep_rad = 3 * std::numbers::pi / 180;
constexpr int kSteps = 20;        // to either side, in search of the wall
constexpr double kScan_m = 0.05;  // steps in search of its edge
constexpr double kDoorWidth_m = 0.9, kDoorHeight_m = 2.0, kAhead_m = 1.5, kEyeAboveMiddle_m = 0.7;
constexpr int kSlats = 8;

Vec3 level_direction(const Vec3& direction) {
  const Vec3 ahead(direction.x, 0, direction.z);
  return length(ahead) > 1e-6 ? normalize(ahead) : Vec3(0, 0, -1);
}

Vec3 normal_at(const Mesh& mesh, std::size_t triangle) {
  const auto& [a, b, c] = mesh.triangles[triangle];
  return normalize(Vec3(
      cross(mesh.vertices_m[b] - mesh.vertices_m[a], mesh.vertices_m[c] - mesh.vertices_m[a])));
}

// A wall with a hole in it: its plane, along the line of sight, and how thick it is.
struct Wall {
  double at_m = 0, thickness_m = 0;
  Vec3 normal{};  // towards the eye
};

std::optional<Wall> wall_ahead(const Mesh& mesh, const Vec3& eye_m, const Vec3& ahead) {
  const PickedTriangle straight = pick(mesh, eye_m, ahead);
  const double through_m = straight.triangle == SIZE_MAX ? kReach_m : straight.distance_m;
  std::optional<Wall> nearest;
  for (int step = -kSteps; step <= kSteps; ++step) {
    const Vec3 ray = glm::angleAxis(step * kStep_rad, Vec3(0, 1, 0)) * ahead;
    const PickedTriangle hit = pick(mesh, eye_m, ray);
    if (hit.triangle == SIZE_MAX || hit.distance_m > 2 * kReach_m) continue;
    Vec3 normal = normal_at(mesh, hit.triangle);
    if (dot(normal, ray) > 0) normal = -normal;
    // Floors and walls along the line of sight have no hole that is looked through.
    if (std::abs(normal.y) > 0.3 || dot(normal, ahead) > -0.5) continue;
    const double at_m = hit.distance_m * dot(ray, normal) / dot(ahead, normal);
    if (at_m < 0.05 || at_m > std::min(kReach_m, through_m - 0.05)) continue;
    if (nearest && nearest->at_m <= at_m) continue;
    const Vec3 inside_m = eye_m + (hit.distance_m + 2e-3) * ray;
    const PickedTriangle back = pick(mesh, inside_m, -normal);
    const bool is_thick = back.triangle != SIZE_MAX && back.distance_m < kMaxThickness_m &&
                          std::abs(dot(normal_at(mesh, back.triangle), normal)) > 0.9;
    nearest = Wall{at_m, is_thick ? back.distance_m : 0.0, normal};
  }
  return nearest;
}

// How far the hole reaches from a place in the wall's plane: to a surface across the way, or to
// where a wall without thickness begins.
double reach_m(const Mesh& mesh, const Vec3& from_m, const Vec3& way, const Vec3& normal) {
  const double free = free_m(mesh, from_m, way, kMaxSide_m);
  constexpr double kOff_m = 0.02;
  const auto is_wall = [&](double at_m) {
    return free_m(mesh, from_m + at_m * way + kOff_m * normal, -normal, kMaxSide_m) < 2 * kOff_m;
  };
  double low_m = 0, high_m = kScan_m;
  while (high_m < free && !is_wall(high_m)) {
    low_m = high_m;
    high_m += kScan_m;
  }
  if (high_m >= free) return free;
  for (int i = 0; i < 8; ++i) {
    const double middle_m = (low_m + high_m) / 2;
    (is_wall(middle_m) ? high_m : low_m) = middle_m;
  }
  return high_m;
}

}  // namespace

std::optional<Portal> doorway_ahead(const Mesh& mesh, const Vec3& eye_m, const Vec3& direction) {
  const Vec3 ahead = level_direction(direction);
  const auto wall = wall_ahead(mesh, eye_m, ahead);
  if (!wall) return std::nullopt;
  const double to_middle_m = wall->at_m - wall->thickness_m / 2 / dot(ahead, wall->normal);
  const Vec3 in_plane_m = eye_m + to_middle_m * ahead;
  const Portal unit = facing_portal(in_plane_m, wall->normal, 2, 2);
  const auto side = [&](const Vec3& way) { return reach_m(mesh, in_plane_m, way, wall->normal); };
  const double right_m = side(unit.half_u_m), left_m = side(-unit.half_u_m);
  const double up_m = side(unit.half_v_m), down_m = side(-unit.half_v_m);
  if (std::max({right_m, left_m, up_m, down_m}) >= kMaxSide_m) return std::nullopt;
  const Vec3 centre_m =
      in_plane_m + (right_m - left_m) / 2 * unit.half_u_m + (up_m - down_m) / 2 * unit.half_v_m;
  const Portal found = facing_portal(centre_m, wall->normal, right_m + left_m, up_m + down_m);
  return is_rectangle(found) ? std::optional(found) : std::nullopt;
}

Portal usual_doorway(const Vec3& eye_m, const Vec3& direction) {
  const Vec3 ahead = level_direction(direction);
  return facing_portal(eye_m + kAhead_m * ahead - Vec3(0, kEyeAboveMiddle_m, 0), -ahead,
                       kDoorWidth_m, kDoorHeight_m);
}

Portal doorway_of(const MovablePart& part) {
  const Boundsf own = bounds_of(part.mesh);
  const Vec3f size_m = own.high_m - own.low_m;
  int thinnest = 0;
  for (const int axis : {1, 2})
    if (size_m[axis] < size_m[thinnest]) thinnest = axis;
  const Matrix axes = glm::mat3_cast(Quaternion(part.rest_pose.rotation));
  const Mesh at_rest = placed(part.mesh, part.rest_pose);
  const Portal unit = facing_portal(Vec3(0), axes[thinnest], 2, 2);
  const auto [low_m, high_m] = bounds_of(at_rest.vertices_m, [&](const Vec3f& vertex) {
    return Vec3(dot(Vec3(vertex), unit.half_u_m), dot(Vec3(vertex), unit.half_v_m),
                dot(Vec3(vertex), axes[thinnest]));
  });
  const Vec3 middle_m = (low_m + high_m) / 2.0;
  constexpr double kLeastSide_m = 0.01;  // of a portal
  Portal portal = facing_portal(
      middle_m.x * unit.half_u_m + middle_m.y * unit.half_v_m + middle_m.z * axes[thinnest],
      axes[thinnest], std::max(high_m.x - low_m.x, kLeastSide_m),
      std::max(high_m.y - low_m.y, kLeastSide_m));
  portal.name = part.name;
  return portal;
}

std::vector<Vec3f> lines_of(const Portal& portal, double openness) {
  const auto at = [&](double u, double v) {
    return Vec3f(portal.centre_m + u * portal.half_u_m + v * portal.half_v_m);
  };
  std::vector<Vec3f> ends{at(-1, -1), at(1, -1), at(1, -1), at(1, 1),
                          at(1, 1),   at(-1, 1), at(-1, 1), at(-1, -1)};
  const auto slats = static_cast<int>(std::ceil((1 - openness) * kSlats - 1e-6));
  for (int i = 1; i <= slats; ++i) {
    const double v = 1 - 2.0 * i / (kSlats + 1);  // from the top
    ends.push_back(at(-1, v));
    ends.push_back(at(1, v));
  }
  return ends;
}

}  // namespace clamor
