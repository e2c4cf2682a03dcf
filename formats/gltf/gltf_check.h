// gltf_check.h: whether a glTF document means what its schema allows, as far as we read it.
//
// Types, counts and every index, so that tinygltf (which ignores a value of the wrong type and
// follows some indices unchecked) is only ever given what it can digest.
#pragma once

#include <string>

#include "common/result.h"
#include "formats/files/json.h"

namespace clamor {

// Names the first thing that is wrong.
Result<void> check_gltf(const Json& document);

// The parts that we read of a checked document, as JSON text for tinygltf: no images, textures,
// animations, extras or URIs.
std::string essential_gltf(const Json& document);

}  // namespace clamor
