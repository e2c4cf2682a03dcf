// page.h: the sources of one octree node, as columns of bytes.
//
// What the ear cannot hear is quantised: position in 1/65535 of the node's box (0.9 mm in a hall of
// 60 m), directions octahedrally in 2 x 16 bits (0.004 degrees), power in half decibels, delay in a
// sixteenth of a sample, patch radius in steps of 4 %. Powers are snapped by the bake
// (snap_powers()), before keys are made of them, so that here they are exact.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "common/result.h"
#include "formats/level.h"
#include "formats/source_octree.h"

namespace clamor {

inline constexpr std::size_t kPageHeaderBytes = 8;
inline constexpr std::size_t kPageRowBytes = 38;

constexpr std::size_t page_bytes(std::size_t sources) {
  return kPageHeaderBytes + kPageRowBytes * sources;
}

// Moves the power of each band to a half decibel above or below, by a coin whose odds keep the
// power right on average (a plain rounding is 0.02 dB off). The coin is a function of the source.
void snap_powers(Source& source);

// The columns of a node's sources: page_bytes(sources.size()) bytes, not yet packed.
std::vector<std::byte> encode_page(const OctreeNode& node, std::span<const Source> sources);

// What an emitter is as a source, from the emitter table. u is left alone.
void set_from_emitter(Source& source, const Emitter& emitter);

// The sources again. Every index and number is checked against the tables.
Result<std::vector<Source>> decode_page(const OctreeNode& node, std::span<const std::byte> bytes,
                                        const std::vector<Emitter>& emitters,
                                        std::size_t materials);

}  // namespace clamor
