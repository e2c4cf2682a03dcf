// level_import.h: reads a level from glTF, its sidecar and the command line, and reports what it
// did.
//
//   LEVEL.gltf | .glb          meshes, instances, KHR_audio_emitter, acoustic materials
//   LEVEL.acoustics.json       the sidecar: emitters, materials, settings (acoustics.schema.json)
//   --emitter "name=..., ..."  emitters from the command line
//
// Later origins override earlier ones: an emitter replaces those of the same name. A level cannot
// read files outside its folder; sounds on the command line are read from anywhere.
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
  std::vector<std::string> emitters{};   // in the syntax of --emitter
  std::optional<std::string> sidecar{};  // instead of LEVEL.acoustics.json beside the level
  std::optional<std::string>
      material{};              // preset for materials without acoustic data, default "plaster"
  bool hidden_meshes = false;  // include nodes that KHR_node_visibility hides
  std::optional<std::uint64_t> seed{};  // of random delays; default: of the sidecar, else 1
};

// Origin of the acoustic values of a material of the level.
struct MaterialAssignment {
  std::string material;  // its name in the level
  std::string preset;    // assigned preset, empty for explicit values
  std::string how;  // "CLAMOR_materials_acoustic", "extras", "sidecar 'brick*'", "name", "default"
  std::size_t triangles = 0;
  double area_m2 = 0;
};

struct ImportReport {
  std::vector<MaterialAssignment> materials;
  std::vector<std::string> found;     // "66454 triangles in 12 meshes on 14 nodes"
  std::vector<std::string> ignored;   // "2 cameras", "textures", "distance model 'linear' of ..."
  std::vector<std::string> warnings;  // problems for the user to check
};

struct ImportedLevel {
  Level level;
  SceneGroups groups;  // of its emitters, by nodes of the glTF scene
  ImportReport report;
  ImportedSettings settings;      // of the sidecar; level.air already contains its air
  std::vector<InputFile> inputs;  // all files read
  InputFiles files;               // the same files, which outputs must not replace
  std::uint64_t input_hash = 0;   // xxHash3 of all bytes read, in a fixed order, and of the result
};

// Errors are sentences that name the file, the thing in it and the next step.
Result<ImportedLevel> import_level(const std::string& path, const ImportOptions& options);

}  // namespace clamor
