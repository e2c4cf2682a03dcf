// source_number.h: source numbers of the bake file and of moving sources.
#pragma once

#include <cstdint>

namespace clamor {

// Set in the numbers of moving sources, clear in those of the file.
inline constexpr std::uint64_t kMovingSourceBit = std::uint64_t{1} << 63;

// Image sources have numbers from here on: above those of the file, below those of probes.
inline constexpr std::uint64_t kFirstImage = std::uint64_t{1} << 61;

constexpr bool is_moving_source(std::uint64_t number) { return (number & kMovingSourceBit) != 0; }

}  // namespace clamor
