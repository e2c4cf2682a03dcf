// version.h: what this build calls itself.
#pragma once

namespace clamor {

inline constexpr const char* kVersion = "0.1.0";

}  // namespace clamor
