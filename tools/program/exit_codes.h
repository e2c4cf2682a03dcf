// exit_codes.h: the exit codes of the program; tools/README.md has the table.
#pragma once

namespace clamor {

inline constexpr int kSuccess = 0;
inline constexpr int kBadInput = 1;  // a file, device or level that cannot be used
inline constexpr int kBadUsage = 2;  // words that make no command
// Ended by SIGINT, SIGTERM or SIGHUP before the work was done, as shells say of SIGINT.
inline constexpr int kInterrupted = 130;

// clamor diff ends as diff and cmp do, with a code of its own for files that cannot be used.
inline constexpr int kDiffers = 1, kDiffBadInput = 3;

}  // namespace clamor
