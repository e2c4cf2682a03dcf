#include "formats/level/level_places.h"

#include <algorithm>
#include <cmath>
#include <string>

#include <fmt/format.h>

#include "common/bounds.h"
#include "formats/level/emitter_spec.h"
#include "formats/level/level.h"

namespace clamor {

namespace {

Result<void> check(const Level& level, const Vec3& place_m, const std::string& what) {
  if (std::max({std::abs(place_m.x), std::abs(place_m.y), std::abs(place_m.z)}) <=
      kMaxEmitterCoordinate_m)
    return {};
  return Error(fmt::format(
      "{} lies {:.0f} km from the level, where 1000 km are the most; the middle of the level is "
      "near {:.0f}, {:.0f}, {:.0f}.",
      what, length(place_m) / 1000, level.origin_m.x, level.origin_m.y, level.origin_m.z));
}

}  // namespace

Result<void> check_places(const Level& level) {
  for (const Emitter& emitter : level.emitters)
    if (auto ok = check(level, emitter.position_m, "emitter " + in_quotes(emitter.name)); !ok.ok())
      return ok;
  for (const Portal& portal : level.portals)
    if (auto ok = check(level, portal.centre_m, "portal " + in_quotes(portal.name)); !ok.ok())
      return ok;
  for (const MovablePart& part : level.movable_parts)
    if (auto ok = check(level, part.rest_pose.position_m, "part " + in_quotes(part.name)); !ok.ok())
      return ok;
  for (const Vec3& probe_m : level.probes_m)
    if (auto ok = check(level, probe_m, "a probe"); !ok.ok()) return ok;
  return {};
}

Result<void> check_surfaces(const Level& level) {
  if (const Boundsf bounds = bounds_of(level.mesh); !bounds.is_empty())
    for (const Vec3f& corner_m : {bounds.low_m, bounds.high_m})
      if (auto ok = check(level, Vec3(corner_m), "a surface"); !ok.ok()) return ok;
  return {};
}

std::vector<std::string> warnings_of_far_portals(const Level& level) {
  Bounds bounds;
  const auto add = [&bounds](const Mesh& mesh) {
    for (const Vec3f& corner_m : mesh.vertices_m) bounds.add(Vec3(corner_m));
  };
  add(level.mesh);
  for (const MovablePart& part : level.movable_parts) add(placed(part.mesh, part.rest_pose));
  for (const Emitter& emitter : level.emitters) bounds.add(emitter.position_m);
  for (const Vec3& probe_m : level.probes_m) bounds.add(probe_m);
  std::vector<std::string> warnings;
  for (const Portal& portal : level.portals) {
    const double reach_m = length(portal.half_u_m) + length(portal.half_v_m);
    if (bounds.is_empty() || bounds.distance2_m2(portal.centre_m) <= reach_m * reach_m) continue;
    const Vec3 at_m = portal.centre_m + level.origin_m;
    warnings.push_back(
        fmt::format("portal '{}' at {:.6g},{:.6g},{:.6g} lies outside the level, so no sound "
                    "passes it; is its place in metres, in the frame of the glTF scene?",
                    portal.name, at_m.x, at_m.y, at_m.z));
  }
  return warnings;
}

}  // namespace clamor
