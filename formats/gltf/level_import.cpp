#include "formats/gltf/level_import.h"

#include <algorithm>
#include <filesystem>
#include <map>
#include <span>

#include <fmt/format.h>

#include "common/text.h"
#include "common/utf8_path.h"
#include "formats/audio/audio_file.h"
#include "formats/files/level_folder.h"
#include "formats/gltf/audio_extensions.h"
#include "formats/gltf/emitter_props.h"
#include "formats/gltf/gltf_compression.h"
#include "formats/gltf/gltf_document.h"
#include "formats/gltf/gltf_groups.h"
#include "formats/gltf/gltf_marks.h"
#include "formats/gltf/gltf_mesh.h"
#include "formats/gltf/gltf_mesh_report.h"
#include "formats/gltf/gltf_movable.h"
#include "formats/gltf/gltf_origin.h"
#include "formats/gltf/gltf_placement.h"
#include "formats/gltf/gltf_scenes.h"
#include "formats/gltf/gltf_sounds.h"
#include "formats/gltf/gltf_surfaces.h"
#include "formats/gltf/level_materials.h"
#include "formats/gltf/report_words.h"
#include "formats/gltf/sky_shell.h"
#include "formats/gltf/tool_losses.h"
#include "formats/level/emitter_spec.h"
#include "formats/level/level_places.h"
#include "formats/level/name_match.h"
#include "formats/level/signal_table.h"

namespace clamor {

namespace {

Result<Sidecar> read_sidecar(const std::string& level, const ImportOptions& options,
                             LevelFolder& folder, ImportReport& report) {
  const std::string path =
      options.sidecar.value_or(path_of(level).replace_extension(".acoustics.json").string());
  std::error_code none;
  if (!options.sidecar && !std::filesystem::exists(path_of(path), none)) return Sidecar{};
  const auto bytes = folder.read_anywhere(path);
  if (!bytes.ok()) return bytes.error();
  auto sidecar = parse_sidecar({reinterpret_cast<const char*>(bytes->data()), bytes->size()},
                               MaterialPresets::built_in());
  if (!sidecar.ok()) return sidecar.error().in(path);
  report.found.push_back("sidecar " + path);
  return sidecar;
}

// Creates an emitter of the sidecar or the command line and decodes its sound.
Result<Emitter> realise(const EmitterSpec& spec, bool confined, LevelFolder& folder,
                        SignalTable& signals, std::uint64_t seed, std::size_t index,
                        const Vec3& origin_m, ImportReport& report) {
  Emitter emitter;
  emitter.name = !spec.name.empty() ? spec.name : path_of(spec.signal).stem().string();
  emitter.position_m = spec.at_m - origin_m;
  emitter.axis = spec.facing;
  emitter.gain = spec.gain;
  emitter.directivity = spec.directivity;
  emitter.delay_s = spec.delay_s + random_start_s(seed, index, spec.random_delay_s);
  const bool loop = spec.loop.value_or(spec.signal != "impulse");
  if (is_built_in_signal(spec.signal)) {
    emitter.signal = signals.built_in(spec.signal, loop);
    return emitter;
  }
  const std::string key = (confined ? "sidecar " : "command line ") + spec.signal;
  if (const auto known = signals.find(key, loop)) {
    emitter.signal = *known;
    return emitter;
  }
  const auto bytes = confined ? folder.read(spec.signal) : folder.read_anywhere(spec.signal);
  if (!bytes.ok()) return bytes.error().in("emitter " + in_quotes(emitter.name));
  Downmix downmix;
  auto samples = decode_audio(*bytes, spec.signal, &downmix);
  if (!samples.ok()) return samples.error().in("emitter " + in_quotes(emitter.name));
  report_downmix(downmix, spec.signal, report);
  const std::string name = path_of(spec.signal).filename().string();
  emitter.signal = signals.add(key, name, std::move(*samples), loop);
  return emitter;
}

// Adds the emitters of one origin; each replaces emitters of earlier origins with the same name.
Result<void> merge(const std::vector<EmitterSpec>& specs, bool confined, LevelFolder& folder,
                   SignalTable& signals, std::uint64_t seed, ImportedLevel& imported) {
  Level& level = imported.level;
  const std::size_t before = level.emitters.size();
  std::vector<Emitter> added;
  std::map<std::string, int> names;
  for (const EmitterSpec& spec : specs) {
    auto emitter = realise(spec, confined, folder, signals, seed, before + added.size(),
                           level.origin_m, imported.report);
    if (!emitter.ok()) return emitter.error();
    const int twin = ++names[emitter->name];
    if (twin > 1 && !spec.name.empty())
      return Error("two emitters are named " + in_quotes(spec.name) + "; give each its own name.");
    if (twin > 1) emitter->name += fmt::format(" {}", twin);
    added.push_back(std::move(*emitter));
  }
  for (Emitter& emitter : added) {
    std::vector<bool> gone;
    for (const Emitter& known : level.emitters) gone.push_back(known.name == emitter.name);
    if (std::erase_if(level.emitters, [&](const Emitter& e) { return e.name == emitter.name; })) {
      remove_emitters(gone, imported.groups);
      imported.report.found.push_back(
          fmt::format("emitter '{}' of the {} in place of the level's own", emitter.name,
                      confined ? "sidecar" : "command line"));
    }
  }
  std::move(added.begin(), added.end(), std::back_inserter(level.emitters));
  return {};
}

// Changes and removes emitters of the level as the sidecar says. Those that change leave their
// groups and follow all others, since they may no longer be congruent.
Result<void> change_emitters(const std::vector<EmitterChange>& changes, ImportedLevel& imported) {
  std::vector<Emitter>& emitters = imported.level.emitters;
  for (const EmitterChange& change : changes) {
    std::vector<Emitter> changed;
    std::vector<bool> gone;
    for (const Emitter& known : emitters) {
      gone.push_back(known.name == change.name);
      if (!gone.back()) continue;
      Emitter emitter = known;
      if (change.at_m) emitter.position_m = *change.at_m - imported.level.origin_m;
      emitter.axis = change.facing.value_or(emitter.axis);
      emitter.gain = change.gain.value_or(emitter.gain);
      emitter.delay_s = change.delay_s.value_or(emitter.delay_s);
      emitter.directivity = change.directivity.value_or(emitter.directivity);
      changed.push_back(std::move(emitter));
    }
    if (changed.empty()) {
      std::vector<std::string> names;
      for (const Emitter& known : emitters) names.push_back(known.name);
      return Error("the sidecar changes an emitter " + in_quotes(change.name) +
                   ", which the level does not have" +
                   (names.empty()
                        ? std::string()
                        : "; the nearest name is " + in_quotes(nearest_name(change.name, names))) +
                   ". Give it a signal to add it, or correct its name.");
    }
    std::erase_if(emitters, [&](const Emitter& known) { return known.name == change.name; });
    remove_emitters(gone, imported.groups);
    imported.report.found.push_back(fmt::format("emitter '{}' {} by the sidecar", change.name,
                                                change.removed ? "removed" : "changed"));
    if (change.removed) continue;
    std::move(changed.begin(), changed.end(), std::back_inserter(emitters));
  }
  return {};
}

// Removes signals that no emitter plays any more and renumbers the others.
void keep_used_signals(Level& level) {
  std::vector<int> place(level.signals.size(), kNone);
  std::vector<Signal> kept;
  for (Emitter& emitter : level.emitters) {
    int& index = place[emitter.signal];
    if (index == kNone) {
      index = static_cast<int>(kept.size());
      kept.push_back(std::move(level.signals[emitter.signal]));
    }
    emitter.signal = static_cast<std::uint32_t>(index);
  }
  level.signals = std::move(kept);
}

void report_ignored(const Json& document, ImportReport& report) {
  for (const char* list : {"images", "cameras", "animations"}) {
    const std::size_t count = document.list(list).size();
    std::string thing(list);
    thing.pop_back();
    if (count > 0) report.ignored.push_back(number_of(count, thing));
  }
}

// A gain of 0 is often a mistake for 0 dB.
void warn_of_silence(const std::vector<Emitter>& emitters, ImportReport& report) {
  const auto silent = [](const Emitter& emitter) { return emitter.gain == 0; };
  const auto count = static_cast<std::size_t>(std::ranges::count_if(emitters, silent));
  if (count == 0) return;
  report.warnings.push_back(fmt::format(
      "{}{} silent, with a gain of 0: a plain number is an amplitude, and 1 leaves a sound as it "
      "is; in decibels, write \"0dB\" or gain_db",
      in_quotes(std::ranges::find_if(emitters, silent)->name),
      count == 1 ? " is"
                 : fmt::format(" and {} of {} are", number_of(count - 1, "other emitter"),
                               emitters.size())));
}

template <class T>
void hash_value(InputHash& hash, const T& value) {
  hash.add(std::as_bytes(std::span(&value, 1)));
}

Result<GltfScene> read_scene(const std::string& path, const ImportOptions& options,
                             LevelFolder& folder, ImportReport& report) {
  auto scene = read_gltf_document(path, folder, options.ignored_extensions);
  if (!scene.ok()) return scene.error();
  restore_kept_extensions(scene->json, report);
  rewrite_audio_extensions(scene->json, report);
  if (const auto ok = choose_scene(*scene, options.scene); !ok.ok()) return ok.error().in(path);
  if (const auto ok = unpack_geometry(*scene); !ok.ok()) return ok.error().in(path);
  report_other_scenes(*scene, report);
  return scene;
}

// Sources of emitters, in order of increasing precedence.
struct EmitterOrigins {
  const GltfScene& scene;
  const std::vector<PlacedNode>& placements;
  std::span<const NodeMarks> marks;  // by node
  const Sidecar& sidecar;
  const std::vector<EmitterSpec>& command_line;

  // Whether the sidecar or the command line changes or replaces an emitter of the scene.
  bool changes(const std::string& name) const {
    const auto is_it = [&name](const auto& entry) { return entry.name == name; };
    return std::ranges::any_of(sidecar.emitter_changes, is_it) ||
           std::ranges::any_of(sidecar.emitters, is_it) || std::ranges::any_of(command_line, is_it);
  }
};

// Reads emitters of all origins and the signals that they play.
Result<void> import_emitters(const EmitterOrigins& origins, LevelFolder& folder, std::uint64_t seed,
                             EmitterProps& props, ImportedLevel& imported) {
  SignalTable signals;
  auto sounds =
      read_scene_sounds(origins.scene, origins.placements, folder, signals, seed, imported.report);
  if (!sounds.ok()) return sounds.error();
  props.add_objects(sounds->emitters, sounds->nodes,
                    [&](const std::string& name) { return origins.changes(name); });
  imported.level.emitters = std::move(sounds->emitters);
  imported.groups = scene_groups(origins.scene, sounds->nodes);
  if (auto ok = change_emitters(origins.sidecar.emitter_changes, imported); !ok.ok()) return ok;
  if (const auto ok = merge(origins.sidecar.emitters, true, folder, signals, seed, imported);
      !ok.ok())
    return ok;
  if (const auto ok = merge(origins.command_line, false, folder, signals, seed, imported); !ok.ok())
    return ok;
  imported.level.signals = signals.take();
  keep_used_signals(imported.level);
  props.add_small(imported.level.emitters);
  return {};
}

// Probes of the scene come before those of the sidecar.
Result<void> import_probes(const EmitterOrigins& origins, const std::vector<Vec3>& sidecar_m,
                           ImportedLevel& imported) {
  auto scene_m = read_scene_probes(origins.scene, origins.marks, origins.placements);
  if (!scene_m.ok()) return scene_m.error();
  std::vector<Vec3>& probes_m = imported.level.probes_m = std::move(*scene_m);
  for (const Vec3& probe_m : sidecar_m) probes_m.push_back(probe_m - imported.level.origin_m);
  if (probes_m.empty()) return {};
  imported.report.found.push_back(number_of(probes_m.size(), "probe") + " placed by hand");
  return {};
}

// Portals of the scene come before those of the sidecar. Marks the placements of the former.
Result<void> import_portals(const GltfScene& scene, std::span<const NodeMarks> marks,
                            std::vector<PlacedNode>& placements,
                            const std::vector<PortalSpec>& of_sidecar,
                            std::vector<PortalSpec>& specs) {
  auto of_scene = read_scene_portals(scene, marks, placements);
  if (!of_scene.ok()) return of_scene.error();
  specs = std::move(*of_scene);
  for (PortalSpec spec : of_sidecar) {
    spec.portal.centre_m -= scene.origin_m;
    specs.push_back(std::move(spec));
  }
  if (specs.size() > kMaxPortals)
    return Error(
        fmt::format("the level has {} portals; at most {} are read.", specs.size(), kMaxPortals));
  return {};
}

// The materials of closed portals are presets, which follow those of the level.
Result<void> add_portals(const std::vector<PortalSpec>& specs, ImportedLevel& imported) {
  Level& level = imported.level;
  std::map<std::string, std::uint16_t> materials;
  std::size_t closed = 0;
  for (const PortalSpec& spec : specs) {
    level.portals.push_back(spec.portal);
    std::uint16_t& index = level.portal_materials.emplace_back(std::uint16_t{0});
    if (!spec.portal.is_baked_closed) continue;
    ++closed;
    const auto next = static_cast<std::uint16_t>(level.materials.size());
    const auto [known, is_new] = materials.try_emplace(spec.material, next);
    index = known->second;
    if (!is_new) continue;
    auto material = MaterialPresets::built_in().get(spec.material);
    if (!material.ok()) return material.error().in("portal " + in_quotes(spec.portal.name));
    level.materials.push_back(std::move(*material));
  }
  if (specs.empty()) return {};
  std::vector<PartPatterns> patterns;
  for (const PortalSpec& spec : specs) patterns.push_back(spec.parts);
  std::string found = number_of(specs.size(), "portal");
  if (closed > 0) found += fmt::format(", {} baked open and closed", closed);
  imported.report.found.push_back(found);
  PortalCoupling coupling = couple_portals(level.movable_parts, patterns, level.portals);
  std::ranges::move(coupling.found, std::back_inserter(imported.report.found));
  std::ranges::move(coupling.warnings, std::back_inserter(imported.report.warnings));
  return {};
}

// What is said of the whole level, once all of it is there.
void report_sounds(const GltfScene& scene, const Level& level, ImportReport& report) {
  report.found.push_back(number_of(level.emitters.size(), "emitter") + " of " +
                         number_of(level.signals.size(), "sound"));
  report_ignored(scene.json, report);
  warn_of_silence(level.emitters, report);
  if (level.emitters.empty() && level.probes_m.empty())
    report.warnings.push_back(
        "nothing in the level makes a sound; give it an emitter, as in "
        "--emitter \"signal=violin.flac,at=1,1.2,-3\"" +
        lost_emitters_in_words(scene.json));
}

}  // namespace

// Options such as --emitter change it, too.
std::uint64_t finish_hash(InputHash& hash, const Level& level) {
  for (const Material& material : level.materials) {
    hash.add(material.name);
    for (const Bands* bands :
         {&material.absorption, &material.scattering, &material.phong, &material.transmission})
      hash_value(hash, *bands);
    if (material.rows_m > 0) hash_value(hash, material.rows_m);
  }
  if (level.origin_m != Vec3(0)) hash_value(hash, level.origin_m);
  for (const Emitter& emitter : level.emitters) {
    hash.add(emitter.name);
    for (const Vec3* vector : {&emitter.position_m, &emitter.axis})
      for (int i = 0; i < 3; ++i) hash_value(hash, (*vector)[i]);
    for (const double value : {emitter.gain, emitter.delay_s}) hash_value(hash, value);
    hash_value(hash, emitter.directivity);
    hash_value(hash, emitter.signal);
  }
  for (const Vec3& probe_m : level.probes_m)
    for (int i = 0; i < 3; ++i) hash_value(hash, probe_m[i]);
  for (const Portal& portal : level.portals) {
    hash.add(portal.name);
    for (const Vec3* vector : {&portal.centre_m, &portal.half_u_m, &portal.half_v_m})
      for (int i = 0; i < 3; ++i) hash_value(hash, (*vector)[i]);
    hash_value(hash, portal.is_baked_closed);
  }
  for (const std::uint16_t material : level.portal_materials) hash_value(hash, material);
  for (const Signal& signal : level.signals) hash_value(hash, signal.loop);
  hash_value(hash, level.mesh.triangles.size());
  for (const MovablePart& part : level.movable_parts) {
    hash.add(part.name);
    hash_value(hash, part.mesh.triangles.size());
  }
  for (const double value :
       {level.air.temperature_c, level.air.humidity_percent, level.air.pressure_kpa})
    hash_value(hash, value);
  return hash.value();
}

Result<ImportedLevel> import_level(const std::string& path, const ImportOptions& options) {
  std::vector<EmitterSpec> command_line;
  for (const std::string& text : options.emitters) {
    auto spec = parse_emitter(text);
    if (!spec.ok()) return spec.error();
    command_line.push_back(std::move(*spec));
  }

  ImportedLevel imported;
  Level& level = imported.level;
  ImportReport& report = imported.report;
  LevelFolder folder(path);
  level.name = path_of(path).filename().string();

  auto scene = read_scene(path, options, folder, report);
  if (!scene.ok()) return scene.error();
  auto sidecar = read_sidecar(path, options, folder, report);
  if (!sidecar.ok()) return sidecar.error();
  imported.settings = sidecar->settings;
  level.air = sidecar->settings.air.value_or(Air{});
  const std::uint64_t seed = options.seed.value_or(sidecar->settings.seed.value_or(1));

  auto placements = place_nodes(*scene);
  if (!placements.ok()) return placements.error().in(path);
  auto movable = find_movable_nodes(*scene, sidecar->movable, report);
  if (!movable.ok()) return movable.error().in(path);
  scene->origin_m = level.origin_m = origin_of(*scene, *placements);
  subtract_origin(*scene, *placements, *movable);
  imported.listeners = sidecar->listeners;
  for (ListenerSpec& listener : imported.listeners) listener.at_m -= level.origin_m;
  std::vector<PortalSpec> portals;
  if (const auto ok =
          import_portals(*scene, movable->marks, *placements, sidecar->portals, portals);
      !ok.ok())
    return ok.error().in(path);
  const SceneSurfaces surfaces =
      find_surfaces(*scene, SurfaceChoice({sidecar->surfaces, {options.ignored, options.kept}}),
                    options.hidden_meshes, report);
  auto mesh = build_mesh(*scene, *placements, *movable, surfaces);
  if (!mesh.ok()) return mesh.error().in(path);
  imported.rounding_m = mesh->rounding_m;
  report_mesh(*scene, *mesh, report);
  report_left_out(*scene, *placements, surfaces, report);
  leave_out_sky_shells(*scene, surfaces, *mesh, report);
  const EmitterOrigins origins{*scene, *placements, movable->marks, *sidecar, command_line};
  EmitterProps props(*scene, surfaces, *mesh);
  if (const auto ok = import_emitters(origins, folder, seed, props, imported); !ok.ok())
    return ok.error().in(path);
  props.leave_out(*mesh, report);
  imported.nodes = named_triangles(*scene, *mesh);
  level.mesh = std::move(mesh->mesh);
  level.movable_parts = movable_parts(*scene, *movable, std::move(mesh->parts), report);
  if (const auto ok = assign_materials(*scene, *sidecar, options.material, folder, level, report);
      !ok.ok())
    return ok.error().in(path);
  warn_of_collapsed_materials(scene->json, report);

  if (const auto ok = add_portals(portals, imported); !ok.ok()) return ok.error().in(path);
  imported.portals = std::move(portals);

  if (const auto ok = import_probes(origins, sidecar->probes_m, imported); !ok.ok())
    return ok.error().in(path);

  report_sounds(*scene, level, report);
  std::ranges::move(warnings_of_far_portals(level), std::back_inserter(report.warnings));
  if (const auto ok = check_places(level); !ok.ok()) return ok.error().in(path);
  imported.inputs = folder.inputs();
  imported.files = folder.files();
  imported.input_hash = finish_hash(folder.hash(), level);
  return imported;
}

}  // namespace clamor
