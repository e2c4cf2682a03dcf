#include "tools/view/edited_level.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <utility>

#include <fmt/format.h>

#include "common/text.h"
#include "formats/files/atomic_file.h"
#include "formats/gltf/level_import.h"
#include "formats/level/material_presets.h"
#include "formats/level/signal_table.h"
#include "tools/view/level_sounds.h"

namespace clamor {

namespace {

// Four decimals are finer than any of these values is known.
Json number(double value) { return Json(std::round(value * 1e4) / 1e4); }

// The shortest number that is read as the same float: transmissions of walls span many decades.
Json exact_number(double value) {
  const std::string text = fmt::format("{}", static_cast<float>(value));
  double shortest = 0;
  std::from_chars(text.data(), text.data() + text.size(), shortest);
  return Json(shortest);
}

Json vector(const Vec3& value) {
  return Json(Json::Array{number(value.x), number(value.y), number(value.z)});
}

// One number if all bands are alike.
Json bands(const Bands& values, Json (*number_of)(double) = number) {
  if (std::ranges::all_of(values, [&](float value) { return value == values[0]; }))
    return number_of(static_cast<double>(values[0]));
  Json::Array list;
  for (const float value : values) list.push_back(number_of(static_cast<double>(value)));
  return Json(std::move(list));
}

Json* find(Json& object, std::string_view key) { return const_cast<Json*>(object.find(key)); }

void set(Json& object, const std::string& key, Json value) {
  if (Json* const known = find(object, key))
    *known = std::move(value);
  else
    object.object()->emplace_back(key, std::move(value));
}

void unset(Json& object, std::string_view key) {
  std::erase_if(*object.object(), [&](const auto& member) { return member.first == key; });
}

Json::Array& list_of(Json& sidecar, const std::string& key) {
  if (find(sidecar, key) == nullptr) set(sidecar, key, Json(Json::Array{}));
  return *find(sidecar, key)->array();
}

// The rule for one material comes first, so that no pattern is before it.
void set_rule(Json& sidecar, const std::string& material, Json values) {
  if (find(sidecar, "materials") == nullptr) set(sidecar, "materials", Json(Json::Object{}));
  Json::Object& rules = *find(sidecar, "materials")->object();
  std::erase_if(rules, [&](const auto& rule) { return rule.first == material; });
  rules.emplace(rules.begin(), material, std::move(values));
}

Json json_of(const Material& material) {
  Json::Object values;
  values.emplace_back("absorption", bands(material.absorption));
  values.emplace_back("scattering", bands(material.scattering));
  // A mirror has no exponent.
  if (material.phong != same_in_all_bands(kMirrorExponent))
    values.emplace_back("phong", bands(material.phong));
  if (material.transmission != Bands{})
    values.emplace_back("transmission", bands(material.transmission, exact_number));
  return Json(std::move(values));
}

Json json_of(const ListenerSpec& listener, const Vec3& origin_m) {
  Json::Object values;
  values.emplace_back("name", Json(listener.name));
  values.emplace_back("at", vector(listener.at_m + origin_m));
  values.emplace_back("yaw", number(listener.yaw_deg));
  values.emplace_back("pitch", number(listener.pitch_deg));
  return Json(std::move(values));
}

std::string read_whole(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
}

Result<void> write_whole(const std::string& path, const std::string& text) {
  auto file = AtomicFile::create(path);
  if (!file.ok()) return file.error();
  if (auto written = file->write(std::as_bytes(std::span(text))); !written.ok()) return written;
  return file->commit();
}

// The place of an emitter's entry in the sidecar, which is its own if it has a signal.
Json* entry_of(Json& sidecar, const std::string& name) {
  for (Json& entry : list_of(sidecar, "emitters")) {
    const Json* const known = entry.find("name");
    if (known != nullptr && known->string() != nullptr && *known->string() == name) return &entry;
    const Json* const signal = entry.find("signal");
    if (known == nullptr && signal != nullptr && signal->string() != nullptr &&
        std::filesystem::path(*signal->string()).stem() == name)
      return &entry;
  }
  return nullptr;
}

LevelState state_of(const ImportedLevel& imported, Json sidecar) {
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
  return state;
}

void write_entries(const Json& value, std::string& out) {
  const auto* const list = value.array();
  const auto* const object = value.object();
  const std::size_t count = list != nullptr ? list->size() : object->size();
  out += list != nullptr ? "[" : "{";
  for (std::size_t i = 0; i < count; ++i) {
    out += i == 0 ? "\n    " : ",\n    ";
    if (list == nullptr) out += dump_json(Json((*object)[i].first)) + ": ";
    out += dump_json(list != nullptr ? (*list)[i] : (*object)[i].second);
  }
  if (count > 0) out += "\n  ";
  out += list != nullptr ? "]" : "}";
}

}  // namespace

std::string sidecar_text(const Json& sidecar) {
  std::string out = "{";
  bool is_first = true;
  for (const auto& [key, value] : *sidecar.object()) {
    out += is_first ? "\n  " : ",\n  ";
    is_first = false;
    out += dump_json(Json(key)) + ": ";
    if (value.array() != nullptr || (value.object() != nullptr && key == "materials"))
      write_entries(value, out);
    else
      out += dump_json(value);
  }
  return out + "\n}\n";
}

EditedLevel::EditedLevel(std::string path, ImportOptions options, LevelState first)
    : path_(std::move(path)),
      sidecar_path_(options.sidecar.value_or(
          std::filesystem::path(path_).replace_extension(".acoustics.json").string())),
      autosave_path_(sidecar_path_ + ".unsaved"),
      options_(std::move(options)),
      history_(std::move(first)) {
  std::error_code none;
  if (std::filesystem::exists(autosave_path_, none)) unsaved_ = read_whole(autosave_path_);
}

Result<EditedLevel> EditedLevel::open(const std::string& path, const ImportOptions& options) {
  auto imported = import_level(path, options);
  if (!imported.ok()) return imported.error();
  const std::string beside = std::filesystem::path(path).replace_extension(".acoustics.json");
  const std::string sidecar_path = options.sidecar.value_or(beside);
  Json sidecar{Json::Object{}};
  std::error_code none;
  if (std::filesystem::exists(sidecar_path, none)) {
    auto read = read_json(sidecar_path);
    if (!read.ok()) return read.error();
    sidecar = std::move(*read);
  }
  EditedLevel edited(path, options, state_of(*imported, std::move(sidecar)));
  edited.input_hash_ = imported->input_hash;
  edited.level_ = std::make_shared<const Level>(std::move(imported->level));
  edited.saved_text_ = edited.sidecar_text();
  if (edited.unsaved_ == edited.saved_text_) edited.unsaved_.reset();
  return edited;
}

const Mesh& EditedLevel::mesh() const { return level_->mesh; }

const Vec3& EditedLevel::origin_m() const { return level_->origin_m; }

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
  set_rule(next.sidecar, name, json_of(values));
  edit(std::move(next), "change " + name, gesture);
}

Result<void> EditedLevel::set_preset(std::size_t material, const std::string& preset) {
  auto values = MaterialPresets::built_in().get(preset);
  if (!values.ok()) return values.error();
  LevelState next = now();
  values->name = next.materials[material].name;
  next.materials[material] = *values;
  next.presets[material] = preset;
  set_rule(next.sidecar, values->name, Json(preset));
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
        spec->name.empty() ? std::filesystem::path(spec->signal).stem().string() : spec->name;
    if (theirs == name) return "It is given on the command line, which overrides the sidecar.";
  }
  return "";
}

void EditedLevel::set_emitter(std::size_t emitter, const Emitter& values, std::size_t gesture) {
  if (!why_fixed(emitter).empty()) return;
  LevelState next = now();
  Emitter& known = next.emitters[emitter];
  Json* entry = entry_of(next.sidecar, known.name);
  if (entry == nullptr) {
    list_of(next.sidecar, "emitters").push_back(Json(Json::Object{{"name", Json(known.name)}}));
    entry = &list_of(next.sidecar, "emitters").back();
  }
  if (values.position_m != known.position_m)
    set(*entry, "at", vector(values.position_m + origin_m()));
  if (values.axis != known.axis) set(*entry, "facing", vector(values.axis));
  if (values.gain != known.gain) set(*entry, "gain", number(values.gain));
  if (values.directivity != known.directivity) {
    unset(*entry, "bandsHz");
    set(*entry, "directivity", bands(values.directivity));
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
  Json::Array& entries = list_of(next.sidecar, "emitters");
  if (Json* const entry = entry_of(next.sidecar, name))
    entries.erase(entries.begin() + (entry - entries.data()));
  if (std::ranges::find(level_->emitters, name, &Emitter::name) != level_->emitters.end())
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
  const std::string stem = std::filesystem::path(signal).stem().string();
  Emitter added;
  added.name = stem;
  const auto is_known = [&](const std::vector<Emitter>& emitters) {
    return std::ranges::find(emitters, added.name, &Emitter::name) != emitters.end();
  };
  for (int n = 2; is_known(next.emitters) || is_known(level_->emitters); ++n)
    added.name = fmt::format("{} {}", stem, n);
  added.position_m = at_m;
  added.axis = normalize(facing);
  list_of(next.sidecar, "emitters")
      .push_back(Json(Json::Object{{"name", Json(added.name)},
                                   {"signal", Json(played)},
                                   {"at", vector(at_m + origin_m())},
                                   {"facing", vector(added.axis)}}));
  next.emitters.push_back(added);
  edit(std::move(next), "add " + added.name);
  return now().emitters.size() - 1;
}

void EditedLevel::set_listener(std::size_t listener, const ListenerSpec& values,
                               std::size_t gesture) {
  LevelState next = now();
  next.listeners[listener] = values;
  list_of(next.sidecar, "listeners")[listener] = json_of(values, origin_m());
  edit(std::move(next), "move " + values.name, gesture);
}

void EditedLevel::add_listener(const ListenerSpec& values) {
  LevelState next = now();
  next.listeners.push_back(values);
  list_of(next.sidecar, "listeners").push_back(json_of(values, origin_m()));
  edit(std::move(next), "add " + values.name);
}

void EditedLevel::remove_listener(std::size_t listener) {
  LevelState next = now();
  const auto at = static_cast<std::ptrdiff_t>(listener);
  const std::string name = next.listeners[listener].name;
  next.listeners.erase(next.listeners.begin() + at);
  Json::Array& entries = list_of(next.sidecar, "listeners");
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

std::string EditedLevel::sidecar_text() const { return clamor::sidecar_text(now().sidecar); }

bool EditedLevel::is_saved() const { return sidecar_text() == saved_text_; }

Result<void> EditedLevel::save() {
  const std::string text = sidecar_text();
  if (auto written = write_whole(sidecar_path_, text); !written.ok()) return written;
  saved_text_ = text;
  discard_autosave();
  return {};
}

Result<void> EditedLevel::autosave() {
  if (!is_saved()) return write_whole(autosave_path_, sidecar_text());
  if (!unsaved_) discard_autosave();
  return {};
}

void EditedLevel::discard_autosave() {
  std::error_code none;
  std::filesystem::remove(autosave_path_, none);
  unsaved_.reset();
}

Result<void> EditedLevel::recover() {
  ImportOptions options = options_;
  options.sidecar = autosave_path_;
  const auto imported = import_level(path_, options);
  if (!imported.ok()) return imported.error();
  auto sidecar = read_json(autosave_path_);
  if (!sidecar.ok()) return sidecar.error();
  unsaved_.reset();
  edit(state_of(*imported, std::move(*sidecar)), "recover unsaved work");
  return {};
}

ImportOptions EditedLevel::import_options() const {
  ImportOptions options = options_;
  if (!is_saved()) options.sidecar = autosave_path_;
  return options;
}

}  // namespace clamor
