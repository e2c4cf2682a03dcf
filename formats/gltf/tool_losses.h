// tool_losses.h: tells what a tool that wrote a glTF file has lost of its sound, and restores what
// it has moved.
//
// Optimisers make one of materials that look alike, and most tools drop extensions that they do not
// know. Nothing in the file is wrong then, but the level sounds like another one. The tool's name
// in asset.generator, or names that it gives, tell it.
#pragma once

#include <string>

#include "formats/files/json.h"
#include "formats/gltf/import_report.h"

namespace clamor {

// asset.generator of a document, or "".
std::string generator_of(const Json& document);

// Moves extras.gltfExtensions of materials and nodes to their `extensions`: GLTFLoader of three.js
// stores extensions that it does not know in userData.gltfExtensions, and GLTFExporter writes that
// as extras. An extension that is already there stays as it is. Warns of nodes with an emitter
// whose list the tool has dropped; these emitters are left out.
void restore_kept_extensions(Json& document, ImportReport& report);

// Warns where one material of the report stands for many of the original. A material that the
// sidecar names is meant.
void warn_of_collapsed_materials(const Json& document, ImportReport& report);

// Why a level may have lost its emitters, as the end of a sentence; empty if nothing tells.
std::string lost_emitters_in_words(const Json& document);

}  // namespace clamor
