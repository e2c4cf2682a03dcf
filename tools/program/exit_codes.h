// exit_codes.h: the exit codes of the program.
#pragma once

namespace clamor {

inline constexpr int kSuccess = 0;
inline constexpr int kBadInput = 1;  // a file, device or level that cannot be used
inline constexpr int kBadUsage = 2;  // words that make no command

}  // namespace clamor
