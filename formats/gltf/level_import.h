// level_import.h: reads a level from glTF, its sidecar and the command line, and reports what it
// did.
//
//   LEVEL.gltf | .glb          meshes, instances, KHR_audio_emitter, acoustic materials
//   LEVEL.acoustics.json       the sidecar: emitters, probes, materials, settings
//   (acoustics.schema.json)
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
#include "formats/gltf/import_options.h"
#include "formats/gltf/import_report.h"
#include "formats/level/level.h"
#include "formats/level/scene_group.h"
#include "formats/level/sidecar.h"

namespace clamor {

struct ImportedLevel {
  Level level;
  double rounding_m = 0;  // of positions, see gltf_mesh.h
  SceneGroups groups;     // of its emitters, by nodes of the glTF scene
  ImportReport report;
  std::vector<ListenerSpec> listeners;  // of the sidecar
  std::vector<PortalSpec> portals;      // those of level.portals, in their order
  std::vector<NamedTriangles> nodes;    // of level.mesh
  ImportedSettings settings;            // of the sidecar; level.air already contains its air
  std::vector<InputFile> inputs;        // all files read
  InputFiles files;                     // the same files, which outputs must not replace
  std::uint64_t input_hash = 0;  // xxHash3 of all bytes read, in a fixed order, and of the result
};

class InputHash;

// Adds all but the mesh and the samples to the hash of what was read, and returns it.
std::uint64_t finish_hash(InputHash& hash, const Level& level);

// Errors are sentences that name the file, the thing in it and the next step.
Result<ImportedLevel> import_level(const std::string& path, const ImportOptions& options);

}  // namespace clamor
