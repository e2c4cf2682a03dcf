// view_doors.cpp: the doors of the window: movable parts and portals, opened, placed and edited.
#include <algorithm>

#include <fmt/format.h>

#include "common/bounds.h"
#include "formats/level/movable_part.h"
#include "formats/level/portal_coupling.h"
#include "tools/view/door_shapes.h"
#include "tools/view/view_session.h"

namespace clamor {

const std::vector<MovablePart>& ViewSession::parts() const {
  return level_ ? level_->parts() : baked_parts_;
}

std::vector<std::size_t> ViewSession::parts_of(std::size_t portal) const {
  return {portals_[portal].parts.begin(), portals_[portal].parts.end()};
}

Mesh ViewSession::part_mesh(std::size_t part) const {
  const MovablePart& moving = parts()[part];
  return placed(moving.mesh, doors_.pose_of(moving, origin_m_));
}

// Takes over the parts and portals of the level, or of the bake without one.
void ViewSession::take_doors() {
  if (level_) {
    portals_.clear();
    std::vector<PartPatterns> patterns;
    for (const PortalSpec& spec : level_->now().portals) {
      portals_.push_back(spec.portal);
      patterns.push_back(spec.parts);
    }
    couple_portals(parts(), patterns, portals_);
  }
  doors_.update(parts(), portals_, origin_m_);
  part_middles_m_.resize(parts().size());
}

void ViewSession::move_doors(double seconds) {
  if (!doors_.advance(seconds)) return;
  ++door_revision_;
  part_vertices_.clear();
  for (std::size_t p = 0; p < parts().size(); ++p) {
    const Mesh mesh = part_mesh(p);
    const Boundsf bounds = bounds_of(mesh);
    part_middles_m_[p] = Vec3(0.5f * (bounds.low_m + bounds.high_m));
    const auto vertices = shade(mesh, colours_);
    part_vertices_.insert(part_vertices_.end(), vertices.begin(), vertices.end());
  }
  sound_->set_doors(doors_);
}

bool ViewSession::is_open(const Selection& door) const {
  return door.kind == Selection::Kind::kPart ? doors_.parts()[door.index].target > 0.5
                                             : doors_.portals()[door.index].target > 0.5;
}

void ViewSession::set_open(const Selection& door, bool open) {
  if (door.kind == Selection::Kind::kPart)
    doors_.move_part(door.index, open ? 1 : 0);
  else
    doors_.open_portal(door.index, open ? 1 : 0);
}

void ViewSession::toggle_door() {
  using Kind = Selection::Kind;
  constexpr double kReach_m = 5, kAheadCosine = 0.5;
  Selection door = selection_;
  if (door.kind != Kind::kPart && door.kind != Kind::kPortal) {
    door = {};
    const Listener at = camera_.listener();
    double nearest_m = kReach_m;
    const auto consider = [&](Kind kind, std::size_t index, const Vec3& place_m) {
      const Vec3 to = place_m - at.position_m;
      const double away_m = length(to);
      if (away_m >= nearest_m || dot(to, at.forward()) < kAheadCosine * away_m) return;
      nearest_m = away_m;
      door = {kind, index, 0};
    };
    for (std::size_t p = 0; p < parts().size(); ++p) consider(Kind::kPart, p, part_middles_m_[p]);
    for (std::size_t p = 0; p < portals_.size(); ++p)
      if (parts_of(p).empty()) consider(Kind::kPortal, p, portals_[p].centre_m);
  }
  if (door.kind == Kind::kNone)
    return say("There is no door within 5 m ahead. Choose one in the list.");
  set_open(door, !is_open(door));
}

Result<void> ViewSession::add_portal(std::optional<std::size_t> of_part) {
  if (!level_) return Error(why_not_editable_);
  const Listener at = camera_.listener();
  PortalSpec spec;
  spec.material = "wood";
  if (of_part) {
    spec.portal = doorway_of(parts()[*of_part]);
  } else if (const auto doorway = doorway_ahead(mesh_, at.position_m, at.forward())) {
    spec.portal = *doorway;
  } else {
    spec.portal = usual_doorway(at.position_m, at.forward());
    say("There is no opening in a wall ahead, so the portal has the size of a door: move it.");
  }
  if (spec.portal.name.empty()) spec.portal.name = fmt::format("portal {}", portals_.size() + 1);
  const std::size_t added = level_->add_portal(spec);
  take_doors();
  select({Selection::Kind::kPortal, added, 0});
  return {};
}

Result<void> ViewSession::set_movable(const std::string& node, bool movable) {
  if (!level_) return Error(why_not_editable_);
  if (auto set = level_->set_movable(node, movable); !set.ok()) return set;
  select({});
  take_shape();
  const auto part = std::ranges::find(parts(), node, &MovablePart::name);
  if (part != parts().end())
    select({Selection::Kind::kPart, static_cast<std::size_t>(part - parts().begin()), 0});
  return {};
}

std::vector<std::string> ViewSession::nodes_of(std::uint32_t triangle) const {
  if (!level_) return {};
  for (const NamedTriangles& one : level_->now().nodes)
    if (triangle >= one.first && triangle < one.end) return one.nodes;
  return {};
}

}  // namespace clamor
