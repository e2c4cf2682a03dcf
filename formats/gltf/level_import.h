// level_import.h: reads a level from glTF, its sidecar and the command line, and says what it did.
//
//   LEVEL.gltf | .glb          meshes, instances, KHR_audio_emitter, acoustic materials
//   LEVEL.acoustics.json       beside it: emitters, materials, settings (acoustics.schema.json)
//   --emitter "name=..., ..."  emitters from the command line
//
// Later sources win over earlier ones: an emitter replaces those of the same name before it.
// Nothing outside the level's folder is read because the level asks for it; sounds named on the
// command line are read from where the user says.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "common/result.h"
#include "formats/files/input_file.h"
#include "formats/files/output_target.h"
#include "formats/level/level.h"
#include "formats/level/scene_group.h"
#include "formats/level/sidecar.h"

namespace clamor {

struct ImportOptions {
  std::vector<std::string> emitters{};    // as --emitter takes them
  std::optional<std::string> sidecar{};   // instead of LEVEL.acoustics.json beside the level
  std::optional<std::string> material{};  // preset for materials nobody assigned, default "plaster"
  bool hidden_meshes = false;             // also take what KHR_node_visibility hides
  std::optional<std::uint64_t> seed{};    // for random starts; default the sidecar's, else 1
};

// How a material came to its acoustic values, one per material of the level.
struct MaterialAssignment {
  std::string material;  // the level's name for it
  std::string preset;    // the preset it got, empty where values were given
  std::string how;  // "CLAMOR_materials_acoustic", "extras", "sidecar 'brick*'", "name", "default"
  std::size_t triangles = 0;
  double area_m2 = 0;
};

struct ImportReport {
  std::vector<MaterialAssignment> materials;
  std::vector<std::string> found;     // "66454 triangles in 12 meshes on 14 nodes"
  std::vector<std::string> ignored;   // "2 cameras", "textures", "distance model 'linear' of ..."
  std::vector<std::string> warnings;  // what the user should look at
};

struct ImportedLevel {
  Level level;
  SceneGroups groups;  // of its emitters, as they stood under the nodes of the glTF scene
  ImportReport report;
  ImportedSettings settings;      // of the sidecar; the air among them is in level.air already
  std::vector<InputFile> inputs;  // every file read
  InputFiles files;               // the same, which no output may replace
  std::uint64_t input_hash = 0;   // xxHash3 of every byte read, in a fixed order, and of the result
};

// Every failure is one sentence that names the file, the thing in it, and what to do.
Result<ImportedLevel> import_level(const std::string& path, const ImportOptions& options);

}  // namespace clamor
