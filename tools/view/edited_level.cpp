#include "tools/view/edited_level.h"

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <utility>

#include <fmt/format.h>

#include "common/text.h"
#include "common/utf8_path.h"
#include "formats/files/atomic_file.h"
#include "formats/gltf/level_import.h"
#include "formats/level/material_presets.h"
#include "formats/level/movable_part.h"
#include "formats/level/signal_table.h"
#include "tools/view/level_sounds.h"
#include "tools/view/sidecar_json.h"

namespace clamor {

namespace {

std::string read_whole(const std::string& path) {
  std::ifstream file(path_of(path), std::ios::binary);
  return {std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
}

// Takes the level, without the samples of its sounds.
LevelState state_of(ImportedLevel&& imported, Json sidecar) {
  LevelState state;
  state.sidecar = std::move(sidecar);
  state.materials = imported.level.materials;
  for (const Material& material : state.materials) {
    const auto& assigned = imported.report.materials;
    const auto it = std::ranges::find(assigned, material.name, &MaterialAssignment::material);
    state.presets.push_back(it == assigned.end() ? "" : it->preset);
  }
  state.emitters = imported.level.emitters;
  state.listeners = imported.listeners;
  state.portals = imported.portals;
  state.nodes = std::move(imported.nodes);
  imported.level.signals.clear();
  state.level = std::make_shared<const Level>(std::move(imported.level));
  return state;
}

}  // namespace

EditedLevel::EditedLevel(std::string path, ImportOptions options, LevelState first)
    : path_(std::move(path)),
      sidecar_path_(
          options.sidecar.value_or(path_of(path_).replace_extension(".acoustics.json").string())),
      autosave_path_(sidecar_path_ + ".unsaved"),
      options_(std::move(options)),
      history_(std::move(first)) {
  std::error_code none;
  if (std::filesystem::exists(path_of(autosave_path_), none)) unsaved_ = read_whole(autosave_path_);
}

Result<EditedLevel> EditedLevel::open(const std::string& path, const ImportOptions& options) {
  auto imported = import_level(path, options);
  if (!imported.ok()) return imported.error();
  const std::string beside = path_of(path).replace_extension(".acoustics.json").string();
  const std::string sidecar_path = options.sidecar.value_or(beside);
  Json sidecar{Json::Object{}};
  std::error_code none;
  if (std::filesystem::exists(path_of(sidecar_path), none)) {
    auto read = read_json(sidecar_path);
    if (!read.ok()) return read.error();
    sidecar = std::move(*read);
  }
  const std::uint64_t input_hash = imported->input_hash;
  EditedLevel edited(path, options, state_of(std::move(*imported), std::move(sidecar)));
  edited.input_hash_ = input_hash;
  edited.saved_text_ = edited.sidecar_text();
  if (edited.unsaved_ == edited.saved_text_) edited.unsaved_.reset();
  return edited;
}

const Mesh& EditedLevel::mesh() const { return now().level->mesh; }

const std::vector<MovablePart>& EditedLevel::parts() const { return now().level->movable_parts; }

const Vec3& EditedLevel::origin_m() const { return now().level->origin_m; }

void EditedLevel::edit(LevelState next, const std::string& what, std::size_t gesture) {
  history_.edit(std::move(next), what, gesture);
  ++revision_;
}

void EditedLevel::set_material(std::size_t material, const Material& values, std::size_t gesture) {
  LevelState next = now();
  const std::string name = next.materials[material].name;
  next.materials[material] = values;
  next.materials[material].name = name;
  next.presets[material].clear();
  sidecar_json::set_rule(next.sidecar, name, sidecar_json::json_of(values));
  edit(std::move(next), "change " + name, gesture);
}

Result<void> EditedLevel::set_preset(std::size_t material, const std::string& preset) {
  auto values = MaterialPresets::built_in().get(preset);
  if (!values.ok()) return values.error();
  LevelState next = now();
  values->name = next.materials[material].name;
  next.materials[material] = *values;
  next.presets[material] = preset;
  sidecar_json::set_rule(next.sidecar, values->name, Json(preset));
  edit(std::move(next), values->name + " as " + preset);
  return {};
}

std::string EditedLevel::why_fixed(std::size_t emitter) const {
  const auto& emitters = now().emitters;
  const std::string& name = emitters[emitter].name;
  if (name.empty()) return "It has no name, which a sidecar needs to change it.";
  const auto namesakes = std::ranges::count(emitters, name, &Emitter::name);
  if (namesakes > 1)
    return fmt::format("{} emitters share its name, so a sidecar cannot change it alone.",
                       namesakes);
  for (const std::string& text : options_.emitters) {
    const auto spec = parse_emitter(text);
    if (!spec.ok()) continue;
    const std::string theirs =
        spec->name.empty() ? path_of(spec->signal).stem().string() : spec->name;
    if (theirs == name) return "It is given on the command line, which overrides the sidecar.";
  }
  return "";
}

void EditedLevel::set_emitter(std::size_t emitter, const Emitter& values, std::size_t gesture) {
  if (!why_fixed(emitter).empty()) return;
  LevelState next = now();
  Emitter& known = next.emitters[emitter];
  Json* entry = sidecar_json::entry_of(next.sidecar, known.name);
  if (entry == nullptr) {
    sidecar_json::list_of(next.sidecar, "emitters")
        .push_back(Json(Json::Object{{"name", Json(known.name)}}));
    entry = &sidecar_json::list_of(next.sidecar, "emitters").back();
  }
  if (values.position_m != known.position_m)
    sidecar_json::set(*entry, "at", sidecar_json::vector(values.position_m + origin_m()));
  if (values.axis != known.axis)
    sidecar_json::set(*entry, "facing", sidecar_json::vector(values.axis));
  if (values.gain != known.gain)
    sidecar_json::set(*entry, "gain", sidecar_json::number(values.gain));
  if (values.directivity != known.directivity) {
    sidecar_json::unset(*entry, "bandsHz");
    sidecar_json::set(*entry, "directivity", sidecar_json::bands(values.directivity));
  }
  known.position_m = values.position_m;
  known.axis = values.axis;
  known.gain = values.gain;
  known.directivity = values.directivity;
  edit(std::move(next), "change " + known.name, gesture);
}

void EditedLevel::remove_emitter(std::size_t emitter) {
  if (!why_fixed(emitter).empty()) return;
  LevelState next = now();
  const std::string name = next.emitters[emitter].name;
  Json::Array& entries = sidecar_json::list_of(next.sidecar, "emitters");
  if (Json* const entry = sidecar_json::entry_of(next.sidecar, name))
    entries.erase(entries.begin() + (entry - entries.data()));
  if (std::ranges::find(now().level->emitters, name, &Emitter::name) != now().level->emitters.end())
    entries.push_back(Json(Json::Object{{"name", Json(name)}, {"removed", Json(true)}}));
  next.emitters.erase(next.emitters.begin() + static_cast<std::ptrdiff_t>(emitter));
  edit(std::move(next), "remove " + name);
}

Result<std::size_t> EditedLevel::add_emitter(const std::string& signal, const Vec3& at_m,
                                             const Vec3& facing) {
  std::string played = signal;
  if (!is_built_in_signal(signal)) {
    auto sound = sound_of_level(path_, signal);
    if (!sound.ok()) return sound.error();
    played = std::move(*sound);
  }
  LevelState next = now();
  const std::string stem = path_of(signal).stem().string();
  Emitter added;
  added.name = stem;
  const auto is_known = [&](const std::vector<Emitter>& emitters) {
    return std::ranges::find(emitters, added.name, &Emitter::name) != emitters.end();
  };
  for (int n = 2; is_known(next.emitters) || is_known(now().level->emitters); ++n)
    added.name = fmt::format("{} {}", stem, n);
  added.position_m = at_m;
  added.axis = normalize(facing);
  sidecar_json::list_of(next.sidecar, "emitters")
      .push_back(Json(Json::Object{{"name", Json(added.name)},
                                   {"signal", Json(played)},
                                   {"at", sidecar_json::vector(at_m + origin_m())},
                                   {"facing", sidecar_json::vector(added.axis)}}));
  next.emitters.push_back(added);
  edit(std::move(next), "add " + added.name);
  return now().emitters.size() - 1;
}

void EditedLevel::set_listener(std::size_t listener, const ListenerSpec& values,
                               std::size_t gesture) {
  LevelState next = now();
  next.listeners[listener] = values;
  sidecar_json::list_of(next.sidecar, "listeners")[listener] =
      sidecar_json::json_of(values, origin_m());
  edit(std::move(next), "move " + values.name, gesture);
}

void EditedLevel::add_listener(const ListenerSpec& values) {
  LevelState next = now();
  next.listeners.push_back(values);
  sidecar_json::list_of(next.sidecar, "listeners")
      .push_back(sidecar_json::json_of(values, origin_m()));
  edit(std::move(next), "add " + values.name);
}

void EditedLevel::remove_listener(std::size_t listener) {
  LevelState next = now();
  const auto at = static_cast<std::ptrdiff_t>(listener);
  const std::string name = next.listeners[listener].name;
  next.listeners.erase(next.listeners.begin() + at);
  Json::Array& entries = sidecar_json::list_of(next.sidecar, "listeners");
  entries.erase(entries.begin() + at);
  edit(std::move(next), "remove " + name);
}

void EditedLevel::undo() {
  if (!history_.can_undo()) return;
  history_.undo();
  ++revision_;
}

void EditedLevel::redo() {
  if (!history_.can_redo()) return;
  history_.redo();
  ++revision_;
}

std::string EditedLevel::sidecar_text() const { return sidecar_json::text_of(now().sidecar); }

bool EditedLevel::is_saved() const { return sidecar_text() == saved_text_; }

Result<void> EditedLevel::save() {
  const std::string text = sidecar_text();
  if (auto written = write_file(sidecar_path_, text); !written.ok()) return written;
  saved_text_ = text;
  discard_autosave();
  return {};
}

Result<void> EditedLevel::autosave() {
  if (!is_saved()) return write_file(autosave_path_, sidecar_text());
  if (!unsaved_) discard_autosave();
  return {};
}

void EditedLevel::discard_autosave() {
  std::error_code none;
  std::filesystem::remove(path_of(autosave_path_), none);
  unsaved_.reset();
}

Result<void> EditedLevel::recover() {
  auto read = read_json(autosave_path_);
  if (!read.ok()) return read.error();
  if (auto taken = import_again(std::move(*read), "recover unsaved work"); !taken.ok())
    return taken;
  unsaved_.reset();
  return {};
}

Result<void> EditedLevel::import_again(Json sidecar, const std::string& what) {
  ImportOptions options = options_;
  options.sidecar = autosave_path_;
  if (auto ok = write_file(autosave_path_, sidecar_json::text_of(sidecar)); !ok.ok()) return ok;
  auto imported = import_level(path_, options);
  if (!imported.ok()) {
    (void)autosave();
    return imported.error();
  }
  edit(state_of(std::move(*imported), std::move(sidecar)), what);
  return {};
}

ImportOptions EditedLevel::import_options() const {
  ImportOptions options = options_;
  if (!is_saved()) options.sidecar = autosave_path_;
  return options;
}

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
