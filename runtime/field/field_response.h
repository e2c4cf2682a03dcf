// field_response.h: the response of a field of taps, as the sampler makes it and the mixer plays
// it.
//
// Sources that play the same signal, beginning at the same time, are taps of one response per ear.
// Time is cut into partitions of a keyframe each. Their spectra are what a partitioned convolution
// multiplies by the spectra of the signal's blocks: of the layer of the high bands at the full
// rate, and of the low bands at a quarter of it (octave_filter_bank.h). The left ear is the real
// part of a complex response and the right ear the imaginary part; more channels are further pairs.
//
// W. G. Gardner. Efficient Convolution without Input-Output Delay. J. Audio Eng. Soc. 43(3), 1995.
#pragma once

#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <limits>
#include <memory>
#include <vector>

#include "runtime/hrtf/diffuse_hrtf_eq.h"
#include "runtime/realtime/realtime.h"
#include "runtime/voices/keyframe.h"
#include "runtime/voices/mix_kernel.h"

namespace clamor {

// The size of a partition and of its transform, in frames of a layer. The margins at both ends of a
// partition hold the ringing of the bands' filters.
struct FieldLayer {
  std::size_t partition, margin, transform;
};
inline constexpr FieldLayer kHighField{kKeyframeFrames, 64, 2048};
inline constexpr FieldLayer kLowField{kKeyframeFrames / kLowRate, 272, 1024};
static_assert(2 * (kHighField.partition + kHighField.margin) == kHighField.transform);
static_assert(2 * (kLowField.partition + kLowField.margin) == kLowField.transform);

// Real parts, then imaginary parts, in the order of LaneFourier.
template <class Number>
struct alignas(64) FieldLayers {
  std::array<Number, 2 * kHighField.transform> high;
  std::array<Number, 2 * kLowField.transform> low;
};
using FieldSums = FieldLayers<float>;
// A spectrum as it is kept: each layer in half precision over a scale of its own, because a
// convolution waits for memory.
struct FieldSpectrum : FieldLayers<std::uint16_t> {
  float high_scale = 0, low_scale = 0;
};

// A signal that taps play. The mixer keeps the spectra of its newest blocks.
struct FieldInput {
  FieldInput(std::uint32_t of_signal, std::int64_t begins_frames, std::size_t partitions)
      : signal(of_signal), start_frames(begins_frames), blocks(partitions), silent(partitions) {}

  // Where the spectrum of a block is kept.
  std::size_t place_of(std::int64_t block) const noexcept REALTIME {
    const auto kept = static_cast<std::int64_t>(blocks.size());
    return static_cast<std::size_t>((block % kept + kept) % kept);
  }

  const std::uint32_t signal;
  const std::int64_t start_frames;  // when the signal's frame 0 is emitted
  // The mixer's.
  std::vector<FieldSpectrum> blocks;
  std::vector<char> silent;  // likewise
  std::int64_t next_block = std::numeric_limits<std::int64_t>::min();
};

// A partition of a signal's response to a pair of channels.
struct FieldPartition {
  FieldInput* input;
  const FieldSpectrum* spectrum;
  std::uint32_t delay;  // in partitions
  std::uint32_t pair;
};

// All of a signal's response, ascending by pair and delay. Successive responses of the field share
// it until it is renewed.
struct FieldSignalResponse {
  std::vector<FieldPartition> partitions;
  std::deque<FieldSpectrum> spectra;  // at least one for each partition
};

// One part's response at one moment. The sampler writes it while it is free, and the mixer frees it
// once it has faded to a later one.
struct FieldResponse {
  std::uint64_t number = 0;  // counts the responses of a part
  // Those that are new, and then those of the response before.
  std::vector<FieldPartition> partitions;
  std::size_t new_partitions = 0;
  std::vector<FieldPartition> replaced;  // partitions of the response before that have ended
  std::vector<std::shared_ptr<const FieldSignalResponse>> signals;  // the sampler's: keeps spectra
  int fade_blocks = 0;  // from the response before; 0 for the first
  // Share of the part of a fade that corrects its power (field_mixer.h), by index of a spectrum.
  std::array<float, kHighField.transform> correction_high{};
  std::array<float, kLowField.transform> correction_low{};
  std::vector<DiffuseHrtfEq::Power> powers;  // binaural: of the taps, by direction
  std::atomic<bool> is_free{true};
};

}  // namespace clamor
