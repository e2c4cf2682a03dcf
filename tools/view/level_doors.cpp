#include "tools/view/level_doors.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "common/bounds.h"
#include "formats/bake_file/baked_portals.h"

namespace clamor {

namespace {

constexpr double kMotion_s = 0.6;  // of a whole motion
constexpr double kTurn_deg = 90;
constexpr double kSide = 0.25;  // of a part's width: a pivot further from its middle is a hinge

// The nearest of this name; null without one.
template <class Things, class Place>
auto* nearest(Things& things, const std::string& name, const Vec3& place_m, Place place_of) {
  auto* found = static_cast<decltype(things.data())>(nullptr);
  for (auto& thing : things) {
    if (thing.name != name) continue;
    if (found == nullptr || length(place_of(thing) - place_m) < length(place_of(*found) - place_m))
      found = &thing;
  }
  return found;
}

Vec3 place_of_part(const LevelDoors::Part& part) { return part.rest_m; }
Vec3 place_of_portal(const LevelDoors::Opening& portal) { return portal.centre_m; }

// Moves a value by at most a step; a door in motion does not jump.
void approach(double& value, double target, double step) {
  value += std::clamp(target - value, -step, step);
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
  std::vector<Part> next_parts;
  for (const MovablePart& part : parts) {
    const Vec3 rest_m = part.rest_pose.position_m + origin_m;
    const Part* const known = nearest(parts_, part.name, rest_m, place_of_part);
    Part& next = next_parts.emplace_back();
    if (known != nullptr)
      next = *known;
    else
      next.motion = guessed_motion(part);
    next.name = part.name;
    next.rest_m = rest_m;
  }
  std::vector<Opening> next_portals;
  for (const Portal& portal : portals) {
    const Vec3 centre_m = portal.centre_m + origin_m;
    const Opening* const known = nearest(portals_, portal.name, centre_m, place_of_portal);
    Opening& next = next_portals.emplace_back();
    if (known != nullptr) next = *known;
    next.name = portal.name;
    next.centre_m = centre_m;
  }
  parts_ = std::move(next_parts);
  portals_ = std::move(next_portals);
  told_parts_.clear();
  told_portals_.clear();
}

bool LevelDoors::advance(double seconds) {
  const double step = seconds / kMotion_s;
  for (Part& part : parts_) approach(part.share, part.target, step);
  for (Opening& portal : portals_) approach(portal.openness, portal.target, step);
  if (parts_ == told_parts_ && portals_ == told_portals_) return false;
  told_parts_ = parts_;
  told_portals_ = portals_;
  return true;
}

PartPose LevelDoors::pose_of(const MovablePart& part, const Vec3& origin_m) const {
  const Part* const known =
      nearest(parts_, part.name, part.rest_pose.position_m + origin_m, place_of_part);
  return known == nullptr ? part.rest_pose : moved(part.rest_pose, known->motion, known->share);
}

std::vector<float> LevelDoors::openness_of(std::span<const Portal> portals,
                                           const Vec3& origin_m) const {
  std::vector<float> openness;
  for (const Portal& portal : portals) {
    const Opening* const known =
        nearest(portals_, portal.name, portal.centre_m + origin_m, place_of_portal);
    openness.push_back(!portal.parts.empty() ? kOpenedByParts
                       : known == nullptr    ? 1.0f
                                             : static_cast<float>(known->openness));
  }
  return openness;
}

}  // namespace clamor
