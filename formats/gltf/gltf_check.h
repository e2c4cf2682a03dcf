// gltf_check.h: validates the parts of a glTF document that Clamor reads.
//
// Checks types, counts and all indices, because tinygltf ignores values of the wrong type and
// follows some indices unchecked.
#pragma once

#include <string>

#include "common/result.h"
#include "formats/files/json.h"

namespace clamor {

// Returns the first error.
Result<void> check_gltf(const Json& document);

// Returns the parts of a checked document that Clamor reads as JSON text for tinygltf, without
// images, textures, animations, extras or URIs.
std::string essential_gltf(const Json& document);

}  // namespace clamor
