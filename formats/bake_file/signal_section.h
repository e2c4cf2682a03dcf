// signal_section.h: encodes signals for a bake file: FLAC blocks and an envelope.
//
// A long signal is divided into blocks of ten seconds that decode independently, so that a player
// only keeps the blocks that it plays.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "common/result.h"
#include "common/sample_rate.h"
#include "formats/bake_file/signal_envelope.h"

namespace clamor {

struct Signal;

inline constexpr std::uint64_t kSignalBlockFrames = std::uint64_t{kSampleRate_hz} * 10;
inline constexpr std::uint64_t kMaxSingleBlock_frames = 2 * kSignalBlockFrames;

// Number of blocks of a signal.
constexpr std::size_t signal_blocks(std::uint64_t frames) {
  if (frames <= kMaxSingleBlock_frames) return 1;
  return static_cast<std::size_t>((frames + kSignalBlockFrames - 1) / kSignalBlockFrames);
}

// Range of frames of a block.
struct SignalBlock {
  std::uint64_t first = 0, frames = 0;
};
constexpr SignalBlock signal_block(std::uint64_t frames, std::size_t block) {
  if (frames <= kMaxSingleBlock_frames) return {0, frames};
  const std::uint64_t first = block * kSignalBlockFrames;
  return {first, std::min(kSignalBlockFrames, frames - first)};
}

// Divisor that keeps a signal within the full scale of FLAC: its peak, but at least 1.
float signal_scale(const Signal& signal);

// Encodes all blocks in parallel.
Result<std::vector<std::vector<std::byte>>> pack_signal_blocks(const Signal& signal, float scale);

// Decodes exactly `frames` frames, or returns an Error such as "has the wrong length". Allocates no
// more, whatever the block claims.
Result<std::vector<float>> unpack_signal_block(std::span<const std::byte> flac,
                                               std::uint64_t frames, float scale);

// Compresses the differences of successive steps of each band.
std::vector<std::byte> pack_envelope(const SignalEnvelope& envelope);
// Allocates memory proportional to `frames`, whatever the section claims.
Result<SignalEnvelope> unpack_envelope(std::span<const std::byte> section, std::uint64_t frames,
                                       const Bands& mean_square);

}  // namespace clamor
