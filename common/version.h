// version.h: version of this program.
#pragma once

namespace clamor {

// As CLAMOR_VERSION_MAJOR, _MINOR and _PATCH in runtime/clamor.h say: "0.1.0".
extern const char* const kVersion;

}  // namespace clamor
