// view_selection.cpp: what is clicked, chosen and looked at in the window.
#include <algorithm>

#include "common/bounds.h"
#include "formats/level/movable_part.h"
#include "tools/report/level_findings.h"
#include "tools/report/room_summary.h"
#include "tools/view/view_session.h"
#include "tools/view/viewpoint.h"

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

}  // namespace clamor
