// version.h: version of this program.
#pragma once

namespace clamor {

inline constexpr const char* kVersion = "0.1.0";

}  // namespace clamor
