// edited_doors.cpp: edits of portals, and of which nodes are movable parts.
#include <algorithm>

#include <fmt/format.h>

#include "common/text.h"
#include "formats/level/movable_part.h"
#include "tools/view/edited_level.h"
#include "tools/view/sidecar_json.h"

namespace clamor {

namespace {

std::string words_of(const PortalSpec& spec) {
  return spec.portal.name.empty() ? "portal" : "portal " + spec.portal.name;
}

bool is_name(const Json& entry, const std::string& name) {
  return entry.string() != nullptr && *entry.string() == name;
}

const Json::Array* movable_in(const Json& sidecar) {
  const Json* const list = sidecar.find("movable");
  return list != nullptr ? list->array() : nullptr;
}

}  // namespace

// Portals of the scene come first (level_import.cpp).
std::size_t EditedLevel::portals_of_scene() const {
  const Json* const list = now().sidecar.find("portals");
  const std::size_t of_sidecar =
      list != nullptr && list->array() != nullptr ? list->array()->size() : 0;
  return now().portals.size() - of_sidecar;
}

std::string EditedLevel::why_portal_fixed(std::size_t portal) const {
  if (portal >= portals_of_scene()) return "";
  return "It is a node of the level; change it in the tool that made the level.";
}

void EditedLevel::set_portal(std::size_t portal, const PortalSpec& values, std::size_t gesture) {
  if (!why_portal_fixed(portal).empty() || !is_rectangle(values.portal)) return;
  const std::size_t entry = portal - portals_of_scene();
  LevelState next = now();
  next.portals[portal] = values;
  sidecar_json::write_portal(sidecar_json::list_of(next.sidecar, "portals")[entry], values,
                             origin_m());
  edit(std::move(next), "change " + words_of(values), gesture);
}

std::size_t EditedLevel::add_portal(const PortalSpec& values) {
  LevelState next = now();
  Json::Array& entries = sidecar_json::list_of(next.sidecar, "portals");
  sidecar_json::write_portal(entries.emplace_back(Json::Object{}), values, origin_m());
  next.portals.push_back(values);
  edit(std::move(next), "add " + words_of(values));
  return now().portals.size() - 1;
}

void EditedLevel::remove_portal(std::size_t portal) {
  if (!why_portal_fixed(portal).empty()) return;
  const std::size_t entry = portal - portals_of_scene();
  LevelState next = now();
  const std::string words = words_of(next.portals[portal]);
  Json::Array& entries = sidecar_json::list_of(next.sidecar, "portals");
  entries.erase(entries.begin() + static_cast<std::ptrdiff_t>(entry));
  if (entries.empty()) sidecar_json::unset(next.sidecar, "portals");
  next.portals.erase(next.portals.begin() + static_cast<std::ptrdiff_t>(portal));
  edit(std::move(next), "remove " + words);
}

std::string EditedLevel::why_movable_fixed(const std::string& node) const {
  const Json::Array* const list = movable_in(now().sidecar);
  if (list != nullptr &&
      std::ranges::any_of(*list, [&](const Json& entry) { return is_name(entry, node); }))
    return "";
  return "It is movable by its extras in the level or by a pattern of the sidecar.";
}

Result<void> EditedLevel::set_movable(const std::string& node, bool movable) {
  if (node.empty())
    return Error("This node has no name, by which the sidecar could make it movable.");
  Json sidecar = now().sidecar;
  Json::Array& list = sidecar_json::list_of(sidecar, "movable");
  std::erase_if(list, [&](const Json& entry) { return is_name(entry, node); });
  if (movable) list.push_back(Json(node));
  if (list.empty()) sidecar_json::unset(sidecar, "movable");
  return import_again(std::move(sidecar),
                      node + (movable ? " as a movable part" : " as a surface of the level"));
}

}  // namespace clamor
