#include "formats/gltf/required_extensions.h"

#include <algorithm>
#include <array>

#include <fmt/format.h>

#include "formats/gltf/audio_extensions.h"
#include "formats/level/name_match.h"

namespace clamor {

namespace {

// Extensions that are read, and those that touch neither geometry nor sound: looks, lights,
// physics, interaction, metadata, avatars. The import tells of those for sound that it cannot read.
constexpr std::array kHarmless =
    std::to_array<std::string_view>({"CLAMOR_*",
                                     "MOZ_*",
                                     "EXT_mesh_gpu_instancing",
                                     "KHR_mesh_quantization",
                                     "KHR_draco_mesh_compression",
                                     "*_meshopt_compression",
                                     "*material*",
                                     "*texture*",
                                     "*lights*",
                                     "*lightmap*",
                                     "*environment*",
                                     "*camera*",
                                     "*animation*",
                                     "*techniques*",
                                     "*xmp*",
                                     "*metadata*",
                                     "*_features",
                                     "*interactivity*",
                                     "*physics*",
                                     "*collision*",
                                     "*collider*",
                                     "*rigid_bod*",
                                     "*implicit_shapes*",
                                     "*_avatar*",
                                     "*_character*",
                                     "KHR_node_*",
                                     "VRM",
                                     "VRMC_*",
                                     "OMI_link*",
                                     "OMI_personality*",
                                     "OMI_seat*",
                                     "OMI_spawn_point*",
                                     "OMI_vehicle*",
                                     "OMI_viewport*",
                                     "FB_ngon_encoding",
                                     "FB_geometry_metadata",
                                     "EXT_mesh_manifold",
                                     "EXT_mesh_primitive_edge_visibility",
                                     "CESIUM_primitive_outline",
                                     "MSFT_lod",
                                     "MSFT_packing_*",
                                     "GODOT_*",
                                     "UNITY_*",
                                     "UNREAL_*",
                                     "NEEDLE_*",
                                     "GRIFFEL_*",
                                     "AGI_*"});

struct Change {
  std::string_view extension, what;
};

// Extensions whose effect is known, although they are not read.
constexpr std::array kChanges = {
    Change{"CESIUM_RTC", "where the whole level lies"},
    Change{"KHR_accessor_float64", "how positions are stored"},
    Change{"KHR_gaussian_splatting*", "what its primitives are"},
    Change{"EXT_implicit_*", "which surfaces it has"},
    Change{"EXT_mesh_primitive_restart", "which triangles its strips have"},
    Change{"MPEG_*", "its buffers and sounds, which are streamed"}};

struct Place {
  const char *list, *what;
};

// What an extension of the items of a list may change.
constexpr std::array kPlaces = {Place{"nodes", "which meshes there are, and where"},
                                Place{"meshes", "the triangles of meshes"},
                                Place{"accessors", "how positions are stored"},
                                Place{"bufferViews", "how positions are stored"},
                                Place{"buffers", "how positions are stored"},
                                Place{"skins", "the shape of skinned meshes"}};
constexpr std::array<const char*, 7> kLooks = {"materials", "textures", "images",    "samplers",
                                               "cameras",   "scenes",   "animations"};

std::size_t count_users(const Json& document, const char* list, std::string_view extension) {
  const auto uses = [&](const Json& item) {
    return item.find({"extensions", extension}) != nullptr;
  };
  return static_cast<std::size_t>(std::ranges::count_if(document.list(list), [&](const Json& item) {
    return uses(item) || std::ranges::any_of(item.list("primitives"), uses);
  }));
}

// What an extension may change; empty if nothing that is heard.
std::string change_by(const Json& document, std::string_view extension) {
  for (const Change& change : kChanges)
    if (glob_matches(change.extension, extension)) return std::string(change.what);
  if (is_audio_extension(extension) ||
      std::ranges::any_of(kHarmless, [&](auto glob) { return glob_matches(glob, extension); }))
    return "";
  for (const Place& place : kPlaces)
    if (const std::size_t users = count_users(document, place.list, extension); users > 0)
      return fmt::format("{} ({} of its {} {} it)", place.what, users, place.list,
                         users == 1 ? "has" : "have");
  if (std::ranges::any_of(kLooks,
                          [&](auto list) { return count_users(document, list, extension) > 0; }))
    return "";
  return "its geometry";
}

}  // namespace

Result<void> check_required_extensions(const Json& document, std::span<const std::string> ignored) {
  const Json* required = document.find("extensionsRequired");
  if (required == nullptr) return {};
  if (required->array() == nullptr) return Error("'extensionsRequired' must be a list of names.");
  for (const Json& item : *required->array()) {
    const std::string name = item.string() == nullptr ? "" : *item.string();
    if (std::ranges::find(ignored, name) != ignored.end()) continue;
    if (const std::string change = change_by(document, name); !change.empty())
      return Error(fmt::format(
          "it requires the extension '{}', which Clamor does not know and which may change {}; "
          "export the level without it, or let --ignore-required {} bake it as it is.",
          name, change, name));
  }
  return {};
}

}  // namespace clamor
