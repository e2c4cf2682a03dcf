// signal_section.h: a signal as a bake file holds it: blocks of FLAC, and its envelope.
//
// A long signal is cut into blocks of ten seconds that decode alone, so that a player needs to hold
// no more of it than what it plays now. Shared by the writer and the reader.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "common/result.h"
#include "formats/bake_file/signal_envelope.h"
#include "formats/level/level.h"

namespace clamor {

inline constexpr std::uint64_t kSignalBlockFrames = std::uint64_t{kSampleRate_hz} * 10;
inline constexpr std::uint64_t kMaxSingleBlock_frames = 2 * kSignalBlockFrames;

// How many blocks a signal of so many frames is kept in.
constexpr std::size_t signal_blocks(std::uint64_t frames) {
  if (frames <= kMaxSingleBlock_frames) return 1;
  return static_cast<std::size_t>((frames + kSignalBlockFrames - 1) / kSignalBlockFrames);
}

// The frames of the signal that a block holds.
struct SignalBlock {
  std::uint64_t first = 0, frames = 0;
};
constexpr SignalBlock signal_block(std::uint64_t frames, std::size_t block) {
  if (frames <= kMaxSingleBlock_frames) return {0, frames};
  const std::uint64_t first = block * kSignalBlockFrames;
  return {first, std::min(kSignalBlockFrames, frames - first)};
}

// What a signal is divided by to be kept, as FLAC ends at full scale: its peak, but at least 1.
float signal_scale(const Signal& signal);

// Each block as FLAC, in parallel.
Result<std::vector<std::vector<std::byte>>> pack_signal_blocks(const Signal& signal, float scale);

// Exactly so many frames, or an Error: "has the wrong length". Allocates them and no more, whatever
// the block holds.
Result<std::vector<float>> unpack_signal_block(std::span<const std::byte> flac,
                                               std::uint64_t frames, float scale);

// The envelope's steps, each less the one before it of its band, as a zstd frame.
std::vector<std::byte> pack_envelope(const SignalEnvelope& envelope);
// Allocates in proportion to `frames`, whatever the section claims.
Result<SignalEnvelope> unpack_envelope(std::span<const std::byte> section, std::uint64_t frames,
                                       const Bands& mean_square);

}  // namespace clamor
