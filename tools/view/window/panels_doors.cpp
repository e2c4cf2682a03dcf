// panels_doors.cpp: the panels that list, open, close and edit movable parts and portals.
#include <algorithm>
#include <cmath>
#include <set>

#include <fmt/format.h>

#include "formats/level/material_presets.h"
#include "formats/level/movable_part.h"
#include "tools/view/window/controls.h"
#include "tools/view/window/panels.h"

namespace clamor {

namespace {

using Kind = Selection::Kind;

std::string name_of(const std::string& name, const char* kind, std::size_t index) {
  return name.empty() ? fmt::format("{} {}", kind, index + 1) : name;
}

}  // namespace

// Returns whether one was selected, so that the lists are no longer shown.
bool Panels::draw_doors() {
  ImGui::Spacing();
  ImGui::TextUnformatted("Doors and portals");
  constexpr std::size_t kMostLines = 100;
  std::size_t lines = 0;
  const auto line = [&](const Selection& door, const std::string& name) {
    if (++lines > kMostLines) return false;
    const bool is_open = session_.is_open(door);
    const char* const action = is_open ? "Close" : "Open";
    const float width = ImGui::CalcTextSize("Close").x + 2 * ImGui::GetStyle().FramePadding.x;
    ImGui::PushID(static_cast<int>(lines));
    ImGui::AlignTextToFramePadding();
    const float rest = ImGui::GetContentRegionAvail().x - width - ImGui::GetStyle().ItemSpacing.x;
    const bool chosen =
        placed("door " + name, ImGui::Selectable((name + "##door").c_str(), false, 0, {rest, 0}));
    ImGui::SameLine(ImGui::GetContentRegionMax().x - width);
    if (button(action, width)) session_.set_open(door, !is_open);
    placed(fmt::format("{} {}", action, name));
    ImGui::PopID();
    if (chosen) session_.select(door);
    return chosen;
  };
  for (std::size_t p = 0; p < session_.parts().size(); ++p)
    if (line({Kind::kPart, p, 0}, name_of(session_.parts()[p].name, "part", p))) return true;
  for (std::size_t p = 0; p < session_.portals().size(); ++p)
    if (session_.parts_of(p).empty() &&
        line({Kind::kPortal, p, 0}, name_of(session_.portals()[p].name, "portal", p)))
      return true;
  if (lines > kMostLines) caption(fmt::format("and {} more", lines - kMostLines));
  if (lines == 0 && !session_.is_editable()) caption("There are none.");
  if (session_.is_editable() && button("Add portal here")) {
    tell(session_.add_portal());
    return true;
  }
  if (lines == 0 && session_.is_editable())
    wrapped_caption(
        "Look through a doorway to give it a portal. Click a door in the level to make it "
        "movable.");
  return false;
}

// How far a door is open, to be changed: a slider from 0 to 100 %, and a button.
bool Panels::drag_share(const char* label, double& share) {
  auto percent = static_cast<float>(100 * share);
  caption(label);
  ImGui::SetNextItemWidth(-1);
  if (!placed(label, ImGui::SliderFloat("##share", &percent, 0, 100, "%.0f %%"))) return false;
  share = static_cast<double>(percent) / 100;
  return true;
}

void Panels::draw_part() {
  const std::size_t index = session_.selection().index;
  const Selection self = session_.selection();
  const MovablePart& part = session_.parts()[index];
  const LevelDoors::Door door = session_.doors().parts()[index];
  if (draw_heading(name_of(part.name, "part", index))) return session_.select({});
  double share = door.target;
  if (drag_share("Moved from where the level has it", share))
    session_.doors().move_part(index, share);
  const bool is_open = session_.is_open(self);
  if (button(is_open ? "Close" : "Open")) session_.set_open(self, !is_open);
  PartMotion motion = door.motion;
  auto turn_deg = static_cast<float>(motion.turn_deg);
  caption("Turns about its pivot by, degrees");
  ImGui::SetNextItemWidth(-1);
  bool changed = placed("Turns by", ImGui::DragFloat("##turn", &turn_deg, 1, -360, 360, "%.0f"));
  motion.turn_deg = static_cast<double>(turn_deg);
  caption("Shifts by, m");
  constexpr double kMost_m = 1000, kLeast_m = -kMost_m;
  ImGui::SetNextItemWidth(-1);
  changed |=
      placed("Shifts by", ImGui::DragScalarN("##shift", ImGuiDataType_Double, &motion.shift_m.x, 3,
                                             0.02f, &kLeast_m, &kMost_m, "%.2f"));
  if (changed) session_.doors().set_motion(index, motion);
  wrapped_caption("How it moves is for listening here, and is not saved: the game moves it.");
  ImGui::Spacing();
  caption("Materials");
  for (const std::uint16_t material :
       std::set<std::uint16_t>(part.mesh.materials.begin(), part.mesh.materials.end())) {
    const std::string& name = session_.materials()[material].name;
    if (placed("material " + name,
               ImGui::Selectable(fmt::format("{}##m{}", name, material).c_str())))
      return session_.select({Kind::kSurface, material, kNoTriangle});
  }
  ImGui::Spacing();
  draw_portals_of_part(index);
  if (!session_.is_editable()) return;
  const std::string why = session_.level().why_movable_fixed(part.name);
  if (button("Fix in place", 0, false, why.empty()))
    tell(session_.set_movable(std::string(part.name), false));
  if (ImGui::IsItemHovered(ImGuiHoveredFlags_AllowWhenDisabled))
    ImGui::SetTooltip(
        "%s", why.empty() ? "The bake traces it as a surface of the level again" : why.c_str());
}

void Panels::draw_portals_of_part(std::size_t part) {
  bool has_portal = false;
  for (std::size_t p = 0; p < session_.portals().size(); ++p) {
    const auto of = session_.parts_of(p);
    if (std::ranges::find(of, part) == of.end()) continue;
    if (!has_portal) caption("Opens and closes the portal");
    has_portal = true;
    const std::string name = name_of(session_.portals()[p].name, "portal", p);
    if (placed("portal " + name, ImGui::Selectable(fmt::format("{}##p{}", name, p).c_str())))
      session_.select({Kind::kPortal, p, 0});
  }
  if (!session_.is_editable() || has_portal) return;
  if (button("Add portal in its doorway")) tell(session_.add_portal(part));
}

void Panels::draw_portal() {
  const std::size_t index = session_.selection().index;
  const Selection self = session_.selection();
  const Portal portal = session_.portals()[index];
  if (draw_heading(name_of(portal.name, "portal", index))) return session_.select({});
  const auto parts = session_.parts_of(index);
  if (parts.empty()) {
    double openness = session_.doors().portals()[index].target;
    if (drag_share("Open", openness)) session_.doors().open_portal(index, openness);
    const bool is_open = session_.is_open(self);
    if (button(is_open ? "Close" : "Open")) session_.set_open(self, !is_open);
  } else {
    caption("Opened and closed by");
    for (const std::size_t part : parts) {
      const std::string name = name_of(session_.parts()[part].name, "part", part);
      if (button(fmt::format("{}##part{}", name, part).c_str()))
        return session_.select({Kind::kPart, part, 0});
    }
  }
  if (session_.is_editable()) edit_portal(index);
}

// Which parts open and close a portal: those that name and place tell, or chosen ones.
bool Panels::edit_parts_of(std::size_t portal, PartPatterns& patterns) {
  const std::vector<MovablePart>& parts = session_.parts();
  if (parts.empty()) return false;
  const auto opening = session_.parts_of(portal);
  caption("Parts that open and close it");
  bool by_place = !patterns.has_value();
  constexpr const char* kByPlace = "the parts of its name or place";
  bool changed = placed(kByPlace, ImGui::Checkbox(kByPlace, &by_place));
  std::set<std::string> chosen, names;
  for (const std::size_t part : opening) chosen.insert(parts[part].name);
  for (const MovablePart& part : parts) names.insert(part.name);
  constexpr std::size_t kMostNames = 100;
  std::size_t lines = 0;
  for (const std::string& name : names) {
    if (name.empty() || ++lines > kMostNames) continue;
    bool opens = chosen.contains(name);
    if (!placed("opened by " + name, ImGui::Checkbox((name + "##opens").c_str(), &opens))) continue;
    changed = true;
    by_place = false;
    if (opens)
      chosen.insert(name);
    else
      chosen.erase(name);
  }
  if (lines > kMostNames) caption("The sidecar names the others.");
  ImGui::Spacing();
  if (changed) {
    if (by_place)
      patterns.reset();
    else
      patterns = std::vector<std::string>(chosen.begin(), chosen.end());
  }
  return changed;
}

void Panels::edit_portal(std::size_t index) {
  PortalSpec spec = session_.level().now().portals[index];
  const std::string why = session_.level().why_portal_fixed(index);
  if (!why.empty()) wrapped_caption(why);
  ImGui::BeginDisabled(!why.empty());
  bool changed = false, at_once = false;
  caption("Name");
  if (portal_named_ != index || !ImGui::IsAnyItemActive()) {
    portal_named_ = index;
    portal_name_.fill(0);
    spec.portal.name.copy(portal_name_.data(), portal_name_.size() - 1);
  }
  ImGui::SetNextItemWidth(-1);
  changed |= placed("Name", ImGui::InputText("##name", portal_name_.data(), portal_name_.size()));
  if (changed) spec.portal.name = portal_name_.data();
  Vec3 centre_m = spec.portal.centre_m, facing = normal_of(spec.portal);
  auto width_m = static_cast<float>(2 * length(spec.portal.half_u_m));
  auto height_m = static_cast<float>(2 * length(spec.portal.half_v_m));
  caption("Position of its middle, m");
  bool shaped = placed("Position", drag_place(centre_m));
  shaped |= drag_direction(facing);
  caption("Width and height, m");
  const float half = (ImGui::GetContentRegionAvail().x - ImGui::GetStyle().ItemSpacing.x) / 2;
  ImGui::SetNextItemWidth(half);
  shaped |= placed("Width", ImGui::DragFloat("##width", &width_m, 0.01f, 0.05f, 1000, "%.2f"));
  ImGui::SameLine();
  ImGui::SetNextItemWidth(half);
  shaped |= placed("Height", ImGui::DragFloat("##height", &height_m, 0.01f, 0.05f, 1000, "%.2f"));
  // Another rectangle of the same portal.
  const auto reshape = [&portal = spec.portal](Portal rectangle) {
    rectangle.name = portal.name;
    rectangle.is_baked_closed = portal.is_baked_closed;
    portal = std::move(rectangle);
  };
  if (shaped)
    reshape(facing_portal(centre_m, facing, static_cast<double>(width_m),
                          static_cast<double>(height_m)));
  changed |= shaped;
  at_once |= edit_parts_of(index, spec.parts);
  constexpr const char* kClosed = "Bake it closed, too";
  at_once |= placed(kClosed, ImGui::Checkbox(kClosed, &spec.portal.is_baked_closed));
  if (spec.portal.is_baked_closed) {
    ImGui::SetNextItemWidth(-1);
    if (placed("Material of the closed portal",
               ImGui::BeginCombo("##closed", spec.material.c_str(), ImGuiComboFlags_HeightLarge))) {
      for (const std::string& name : MaterialPresets::built_in().names())
        if (ImGui::Selectable(name.c_str(), name == spec.material)) {
          spec.material = name;
          at_once = true;
        }
      ImGui::EndCombo();
    }
  }
  if (button("Fit to the opening ahead")) {
    const Listener here = session_.camera().listener();
    if (const auto fitted = doorway_ahead(session_.mesh(), here.position_m, here.forward())) {
      reshape(*fitted);
      at_once = true;
    } else {
      session_.say(
          "There is no opening in a wall ahead within 8 m. Stand before it and look through.");
    }
  }
  ImGui::EndDisabled();
  if ((changed || at_once) && why.empty())
    session_.level().set_portal(index, spec, at_once ? 0 : gesture());
  if (button("Remove portal", 0, false, why.empty())) {
    session_.level().remove_portal(index);
    session_.select({});
  }
}

// Offers to make a movable part of the node that the selected surface belongs to, or of one above.
void Panels::draw_nodes() {
  const std::vector<std::string> nodes = session_.nodes_of(session_.selection().triangle);
  if (nodes.empty()) return;
  ImGui::SetNextItemWidth(-1);
  if (!placed("Make a door of it",
              ImGui::BeginCombo("##movable", "Make a door of it: choose its node")))
    return;
  std::string chosen;
  for (std::size_t n = 0; n < nodes.size(); ++n) {
    if (nodes[n].empty()) continue;
    if (placed("node " + nodes[n], ImGui::Selectable(fmt::format("{}##n{}", nodes[n], n).c_str())))
      chosen = nodes[n];
  }
  if (std::ranges::all_of(nodes, [](const std::string& name) { return name.empty(); }))
    caption("The node has no name, by which the sidecar could name it.");
  ImGui::EndCombo();
  if (!chosen.empty()) tell(session_.set_movable(chosen, true));
}

}  // namespace clamor
