#include "formats/gltf/tool_losses.h"

#include <algorithm>
#include <array>
#include <string_view>

#include <fmt/format.h>

#include "common/text.h"
#include "formats/level/name_match.h"

namespace clamor {

namespace {

constexpr std::string_view kPacker = "gltfpack", kTransform = "glTF-Transform";
constexpr std::string_view kPalette = "PaletteMaterial*";

// Tools that drop emitters, by the beginning of asset.generator, and what keeps them.
struct Dropper {
  std::string_view generator, remedy;
};
constexpr std::string_view kElsewhere = "give them in the sidecar or with --emitter";
constexpr std::array kDroppers = {
    Dropper{kPacker, kElsewhere},
    Dropper{kTransform, kElsewhere},
    Dropper{"Godot Engine", kElsewhere},
    Dropper{"Open Asset Import Library", kElsewhere},
    Dropper{"THREE.GLTFExporter", kElsewhere},
    Dropper{"Khronos glTF Blender I/O", "export it with Clamor's add-on for Blender"}};

bool has_node_names(const Json& document) {
  return std::ranges::any_of(document.list("nodes"),
                             [](const Json& node) { return node.find("name") != nullptr; });
}

// Moves the extensions that extras of a material or node hold, and returns whether an emitter has
// no list.
bool restore(Json& owner, const Json& lists) {
  const Json* kept = owner.find({"extras", "gltfExtensions"});
  if (kept == nullptr || kept->object() == nullptr) return false;
  const Json::Object moved = *kept->object();
  if (owner.find("extensions") == nullptr) owner.add("extensions", Json(Json::Object{}));
  Json* extensions = owner.member("extensions");
  if (extensions->object() == nullptr) return false;
  bool is_lost = false;
  for (const auto& [name, value] : moved) {
    const bool has_no_list =
        name.find("_audio") != std::string::npos && lists.find(name) == nullptr;
    is_lost |= has_no_list;
    if (!has_no_list && extensions->find(name) == nullptr) extensions->add(name, value);
  }
  return is_lost;
}

// A material whose acoustics nobody chose for the level as it is now.
bool is_guessed(const MaterialAssignment& material) {
  return material.how == "name" || material.how == "doubt" || material.how == "default";
}

void warn_of_palettes(const std::string& generator, ImportReport& report) {
  std::string names;
  double area_m2 = 0, all_m2 = 0;
  for (const MaterialAssignment& material : report.materials) {
    all_m2 += material.area_m2;
    if (!glob_matches(kPalette, material.material) || material.how.starts_with("sidecar")) continue;
    names += (names.empty() ? "" : ", ") + in_quotes(material.material);
    area_m2 += material.area_m2;
  }
  if (names.empty()) return;
  report.warnings.push_back(fmt::format(
      "{} covers {:.0f} % of the level's surface: gltf-transform's palette has put materials "
      "together that had acoustics or names of their own, and the first one's acoustics are "
      "everybody's now; run 'gltf-transform optimize --palette false --join false --flatten false "
      "--prune false --instance false' and dedup with '--materials false', or bake the level as it "
      "was before{}",
      names, all_m2 > 0 ? 100 * area_m2 / all_m2 : 0.0,
      generator.empty() ? "" : " (" + generator + ")"));
}

}  // namespace

std::string generator_of(const Json& document) {
  const Json* asset = document.find("asset");
  return asset == nullptr ? "" : asset->text("generator");
}

void restore_kept_extensions(Json& document, ImportReport& report) {
  const Json* root = document.find("extensions");
  const Json lists = root == nullptr ? Json() : *root;
  for (const char* list : {"materials", "nodes"})
    for (Json& owner : document.list(list))
      if (restore(owner, lists))
        report.warnings.push_back(fmt::format(
            "node '{}' has an emitter in extras.gltfExtensions, but the tool that put it there has "
            "dropped the list of emitters; it is left out: give it in the sidecar or with "
            "--emitter",
            owner.text("name")));
}

void warn_of_collapsed_materials(const Json& document, ImportReport& report) {
  const std::string generator = generator_of(document);
  warn_of_palettes(generator, report);
  const auto& materials = report.materials;
  const bool is_one = materials.size() == 1 && is_guessed(materials[0]);
  if (generator.starts_with(kPacker) &&
      (is_one || (!has_node_names(document) && std::ranges::any_of(materials, is_guessed))))
    report.warnings.push_back(fmt::format(
        "{} wrote this level, and {}: without -km it makes one of materials that look alike, "
        "whatever their names, and without -ke it drops extras; extensions with acoustics or "
        "emitters are lost in any case. Pack the level with 'gltfpack -km -ke -kn', with acoustics "
        "in extras or in the sidecar and emitters in the sidecar, or bake it as it was before",
        generator,
        is_one ? in_quotes(materials[0].material) + " covers all of it"
               : fmt::format("{} materials are left", materials.size())));
  else if (generator.starts_with(kTransform) && is_one &&
           !glob_matches(kPalette, materials[0].material))
    report.warnings.push_back(fmt::format(
        "{} wrote this level, and {} covers all of it: dedup and optimize make one of materials "
        "that look alike, whatever their names; run dedup with '--materials false', and optimize "
        "with '--palette false --join false --flatten false --prune false --instance false', or "
        "bake the level as it was before",
        generator, in_quotes(materials[0].material)));
}

std::string lost_emitters_in_words(const Json& document) {
  const std::string generator = generator_of(document);
  if (document.find({"extensions", "KHR_audio_emitter"}) != nullptr) return "";
  for (const Dropper& tool : kDroppers)
    if (generator.starts_with(tool.generator))
      return fmt::format(
          ". If it had emitters, {} has dropped them, as it does with extensions that it does not "
          "know: {}",
          generator, tool.remedy);
  return "";
}

}  // namespace clamor
