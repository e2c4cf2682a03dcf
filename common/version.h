// version.h: version of this program.
#pragma once

namespace clamor {

inline constexpr const char* kVersion = "0.1.0";

// Begins the provenance's tool of a bake whose level an application made, so that no command makes
// it again. A version follows.
inline constexpr const char* kLibraryTool = "libclamor_bake ";

}  // namespace clamor
