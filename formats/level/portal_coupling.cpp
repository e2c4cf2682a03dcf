#include "formats/level/portal_coupling.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "common/bounds.h"
#include "common/maths.h"
#include "common/text.h"
#include "formats/level/name_match.h"

namespace clamor {

namespace {

constexpr double kMaxHeight_m = 0.25;  // of a closed door's corners above the portal's plane
constexpr double kMinCovered = 0.25;   // share of the rectangle; a double door's leaf covers half
constexpr int kTurns = 24;
constexpr std::size_t kMaxNamed = 8;  // portals in the report

// Whether the part covers a good deal of the rectangle, as a closed door or a leaf of one does.
bool covers(const Portal& portal, const MovablePart& part, const PartPose& pose) {
  const Vec3 normal = normal_of(portal);
  const Matrix to_world = pose.scale * glm::mat3_cast(Quaternion(pose.rotation));
  Bounds bounds;
  for (const Vec3f& corner : part.mesh.vertices_m) {
    const Vec3 from_centre_m = pose.position_m + to_world * Vec3(corner) - portal.centre_m;
    const double height_m = dot(from_centre_m, normal);
    if (std::abs(height_m) > kMaxHeight_m) return false;
    bounds.add({dot(from_centre_m, portal.half_u_m) / dot(portal.half_u_m, portal.half_u_m),
                dot(from_centre_m, portal.half_v_m) / dot(portal.half_v_m, portal.half_v_m), 0});
  }
  double share = 1;
  for (const int axis : {0, 1})
    share *= std::max(
        0.0, (std::min(bounds.high_m[axis], 1.0) - std::max(bounds.low_m[axis], -1.0)) / 2);
  return share >= kMinCovered;
}

// Whether the part covers the rectangle at rest, or turned about its pivot as a door or a hatch.
bool can_close(const Portal& portal, const MovablePart& part) {
  for (const Vec3* side_m : {&portal.half_u_m, &portal.half_v_m})
    for (int turn = 0; turn < kTurns; ++turn) {
      const double half_rad = std::numbers::pi * turn / kTurns;
      const Quaternion by(cos_of(half_rad), sin_of(half_rad) * normalize(*side_m));
      PartPose pose = part.rest_pose;
      pose.rotation = Rotation(by * Quaternion(pose.rotation));
      if (covers(portal, part, pose)) return true;
    }
  return false;
}

double distance_m(const Portal& portal, const MovablePart& part) {
  return length(portal.centre_m - part.rest_pose.position_m);
}

std::string names_of(const Portal& portal, std::span<const MovablePart> parts) {
  std::vector<std::string> names;
  for (const std::uint16_t part : portal.parts) names.push_back(in_quotes(parts[part].name));
  return fmt::format("{}", fmt::join(names, ", "));
}

void take_patterns(std::span<const MovablePart> parts, const std::vector<std::string>& patterns,
                   Portal& portal, std::vector<std::string>& warnings) {
  for (const std::string& pattern : patterns) {
    bool is_used = false;
    for (std::size_t p = 0; p < parts.size(); ++p) {
      if (!glob_matches(pattern, parts[p].name)) continue;
      is_used = true;
      const auto index = static_cast<std::uint16_t>(p);
      if (std::ranges::find(portal.parts, index) == portal.parts.end())
        portal.parts.push_back(index);
    }
    if (is_used) continue;
    std::vector<std::string> names;
    for (const MovablePart& part : parts) names.push_back(part.name);
    warnings.push_back(
        names.empty()
            ? fmt::format("the parts '{}' of portal '{}' match nothing, because the level has no "
                          "movable part; mark the door's node as movable",
                          pattern, portal.name)
            : fmt::format(
                  "the parts '{}' of portal '{}' match no movable part; the nearest is '{}'",
                  pattern, portal.name, nearest_name(pattern, names)));
  }
}

// The nearest portal that has the part's name and no patterns; null without one.
Portal* namesake(const MovablePart& part, std::span<const PartPatterns> patterns,
                 std::span<Portal> portals) {
  Portal* nearest = nullptr;
  for (std::size_t i = 0; i < portals.size(); ++i) {
    if (patterns[i] || part.name.empty() || portals[i].name != part.name) continue;
    if (nearest == nullptr || distance_m(portals[i], part) < distance_m(*nearest, part))
      nearest = &portals[i];
  }
  return nearest;
}

}  // namespace

PortalCoupling couple_portals(std::span<const MovablePart> parts,
                              std::span<const PartPatterns> patterns, std::span<Portal> portals) {
  PortalCoupling coupling;
  for (std::size_t i = 0; i < portals.size(); ++i)
    if (patterns[i]) take_patterns(parts, *patterns[i], portals[i], coupling.warnings);
  for (std::size_t p = 0; p < parts.size(); ++p) {
    const auto index = static_cast<std::uint16_t>(p);
    if (Portal* const same = namesake(parts[p], patterns, portals)) {
      same->parts.push_back(index);
      continue;
    }
    for (std::size_t i = 0; i < portals.size(); ++i)
      if (!patterns[i] && can_close(portals[i], parts[p])) portals[i].parts.push_back(index);
  }
  std::size_t coupled = 0;
  for (const Portal& portal : portals) {
    for (std::size_t p = 0; p < parts.size(); ++p)
      if (std::ranges::find(portal.parts, p) == portal.parts.end() &&
          covers(portal, parts[p], parts[p].rest_pose))
        coupling.warnings.push_back(fmt::format(
            "the movable part '{0}' stands closed in the portal '{1}', which stays open until the "
            "game closes it; let the part open and close it (\"parts\": [\"{0}\"] of the portal), "
            "or set both in the game",
            parts[p].name, portal.name));
    if (portal.parts.empty()) continue;
    if (++coupled <= kMaxNamed)
      coupling.found.push_back(fmt::format("portal '{}' opens and closes with {}", portal.name,
                                           names_of(portal, parts)));
  }
  if (coupled > kMaxNamed)
    coupling.found.push_back(
        fmt::format("{} more portals open and close with movable parts", coupled - kMaxNamed));
  return coupling;
}

}  // namespace clamor
