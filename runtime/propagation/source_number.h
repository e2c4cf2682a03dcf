// source_number.h: whose source a number names: the file's, or the caller's, which may move.
#pragma once

#include <cstdint>

namespace clamor {

// Numbers of moving sources have this bit, and those of a file's do not.
inline constexpr std::uint64_t kMovingSourceBit = std::uint64_t{1} << 63;

constexpr bool is_moving_source(std::uint64_t number) { return (number & kMovingSourceBit) != 0; }

}  // namespace clamor
