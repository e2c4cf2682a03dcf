// source_number.h: source numbers of the bake file and of moving sources.
#pragma once

#include <cstdint>

namespace clamor {

// Set in the numbers of moving sources, clear in those of the file.
inline constexpr std::uint64_t kMovingSourceBit = std::uint64_t{1} << 63;

// Image sources have numbers from here on: above those of the file, below those of probes.
inline constexpr std::uint64_t kFirstImage = std::uint64_t{1} << 61;

// The sources of probes have numbers from here on, and first reflections further ones.
inline constexpr std::uint64_t kFirstProbeSource = std::uint64_t{1} << 62;
inline constexpr std::uint64_t kFirstTracedReflection =
    kFirstProbeSource + (std::uint64_t{1} << 61);

// Identifies the voice of a reflection of a source: of its copy of a probe's source, or of its
// image in a movable part.
constexpr std::uint64_t voice_number(std::uint64_t source, std::uint64_t reflection) {
  std::uint64_t mixed = source * 0x9e3779b97f4a7c15u ^ reflection;
  mixed = (mixed ^ mixed >> 32) * 0xd6e8feb86659fd93u;
  mixed ^= mixed >> 32;
  return mixed | kMovingSourceBit;
}

constexpr bool is_moving_source(std::uint64_t number) { return (number & kMovingSourceBit) != 0; }

}  // namespace clamor
