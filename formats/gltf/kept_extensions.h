// kept_extensions.h: puts extensions that a tool has kept in extras back in their place.
//
// GLTFLoader of three.js stores extensions that it does not know in userData.gltfExtensions, and
// GLTFExporter writes that as extras.gltfExtensions. Acoustic materials and emitters survive there.
#pragma once

#include <string>
#include <vector>

#include "formats/files/json.h"

namespace clamor {

// Moves extras.gltfExtensions of materials and nodes to their `extensions`. An extension that is
// already there stays as it is. Returns the names of nodes with an emitter whose list the tool has
// dropped; these emitters are left out.
std::vector<std::string> restore_kept_extensions(Json& document);

}  // namespace clamor
