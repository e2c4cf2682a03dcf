// view_selection.cpp: what is clicked, chosen and looked at in the window, and its doors.
#include <algorithm>

#include <fmt/format.h>

#include "common/bounds.h"
#include "formats/level/movable_part.h"
#include "formats/level/portal_coupling.h"
#include "tools/report/level_findings.h"
#include "tools/report/room_summary.h"
#include "tools/view/view_session.h"

namespace clamor {

Listener ViewSession::viewpoint(const Vec3& place_m, double size_m) const {
  std::vector<Vec3> inside_m;
  for (const Emitter& emitter : emitters()) {
    inside_m.push_back(emitter.position_m);
    if (inside_m.size() == 2) break;
  }
  if (inside_m.empty() && !mesh_.vertices_m.empty()) {
    const auto [low_m, high_m] = bounds_of(mesh_.vertices_m);
    inside_m.push_back(Vec3(0.5f * (low_m + high_m)));
  }
  if (sound_ != nullptr) inside_m.push_back(camera_.listener().position_m);
  return viewpoint_of(mesh_, place_m, size_m, inside_m);
}

void ViewSession::take_findings() {
  const auto file = sound_->file();
  if (file == findings_of_) return;
  findings_of_ = file;
  findings_ = findings_of(file->statistics());
  for (LevelFinding& finding : findings_)
    if (finding.place_m) *finding.place_m -= origin_m_;
  t30_s_ = file->statistics().decay.t30_s;
  cause_of_decay_.clear();
  if (file->materials().size() >= materials().size())  // it is of this level
    cause_of_decay_ = clamor::cause_of_decay(file->statistics().decay, met_materials(*file));
  // Printed places are rounded to decimetres.
  constexpr double kNear_m = 0.1;
  if (!mark_ || mark_->kind != LevelFinding::Kind::kFact) return;
  for (const LevelFinding& finding : findings_)
    if (finding.place_m && length(*finding.place_m - mark_->place_m) < kNear_m) {
      mark_ = PlaceMark{*finding.place_m, title_of(finding.kind), finding.kind};
      return say(finding.text);
    }
}

void ViewSession::show(const LevelFinding& finding) {
  if (!finding.place_m) return;
  camera_.place(viewpoint(*finding.place_m, finding.size_m));
  mark_ = PlaceMark{*finding.place_m, title_of(finding.kind), finding.kind};
  say(finding.text);
}

void ViewSession::check_selection() {
  const bool is_gone =
      (selection_.kind == Selection::Kind::kEmitter && selection_.index >= emitters().size()) ||
      (selection_.kind == Selection::Kind::kListener && selection_.index >= listeners().size()) ||
      (selection_.kind == Selection::Kind::kPart && selection_.index >= parts().size()) ||
      (selection_.kind == Selection::Kind::kPortal && selection_.index >= portals_.size());
  if (is_gone) select({});
}

void ViewSession::select_at(double x, double y, double aspect) {
  using Kind = Selection::Kind;
  const Vec3 from = camera_.listener().position_m, direction = camera_.ray(x, y, aspect);
  const PickedTriangle surface = pick(mesh_, from, direction);
  Selection found;
  double limit_m = 1e9;
  if (surface.triangle != SIZE_MAX) {
    found = {Kind::kSurface, mesh_.materials[surface.triangle],
             static_cast<std::uint32_t>(surface.triangle)};
    limit_m = surface.distance_m;
  }
  for (std::size_t p = 0; p < parts().size(); ++p) {
    const PickedTriangle part = pick(part_mesh(p), from, direction);
    if (part.triangle == SIZE_MAX || part.distance_m >= limit_m) continue;
    found = {Kind::kPart, p, 0};
    limit_m = part.distance_m;
  }
  std::vector<Vec3> places;
  std::vector<Selection> of_places;
  const auto add = [&](Kind kind, std::size_t index, const Vec3& place_m) {
    places.push_back(place_m);
    of_places.push_back({kind, index, 0});
  };
  for (std::size_t i = 0; i < emitters().size(); ++i)
    add(Kind::kEmitter, i, emitters()[i].position_m);
  for (std::size_t i = 0; i < listeners().size(); ++i) add(Kind::kListener, i, listeners()[i].at_m);
  for (std::size_t i = 0; i < portals_.size(); ++i) add(Kind::kPortal, i, portals_[i].centre_m);
  const std::size_t place = pick_point(places, from, direction, limit_m);
  select(place != SIZE_MAX ? of_places[place] : found);
}

void ViewSession::select(const Selection& selection) {
  selection_ = selection;
  surface_.clear();
  outline_.clear();
  ++door_revision_;  // the outline of a part follows it
  if (selection.kind != Selection::Kind::kSurface || selection.triangle == kNoTriangle) return;
  surface_ = surface_of(mesh_, selection.triangle);
  outline_ = outline_of(mesh_, surface_);
}

Result<void> ViewSession::add_emitter(const std::string& signal) {
  if (!level_) return Error(why_not_editable_);
  constexpr double kAhead_m = 1.5;
  const Listener at = camera_.listener();
  const PickedTriangle wall = pick(mesh_, at.position_m, at.forward());
  const double ahead_m =
      wall.triangle == SIZE_MAX ? kAhead_m : std::min(kAhead_m, 0.6 * wall.distance_m);
  const auto added =
      level_->add_emitter(signal, at.position_m + ahead_m * at.forward(), -1.0 * at.forward());
  if (!added.ok()) return added.error();
  select({Selection::Kind::kEmitter, *added, 0});
  return {};
}

// Doors: movable parts and portals, opened, placed and edited.

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
