// version.h: version of this program.
#pragma once

namespace clamor {

// As CLAMOR_VERSION_MAJOR, _MINOR and _PATCH in runtime/clamor.h say: "0.1.0".
extern const char* const kVersion;

// Begins the provenance's tool of a bake whose level an application made, so that no command makes
// it again. A version follows.
inline constexpr const char* kLibraryTool = "libclamor_bake ";

}  // namespace clamor
