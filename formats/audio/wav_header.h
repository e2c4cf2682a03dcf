// wav_header.h: header of a WAV file of any length.
//
//   RIFF (RF64)   size of what follows, "WAVE"
//   JUNK (ds64)   28 bytes for 64-bit lengths, used if 32 bits do not suffice
//   fmt           16 bytes for integers, 18 for floats, 40 with a channel mask
//   fact          for floats: the number of frames
//   data          size of the samples, which follow
//
// The size of the header does not depend on the length of the sound, so a growing file only
// rewrites its header.
//
// EBU Tech 3306: RF64, an Extended File Format for Audio. Geneva, 2009.
// Microsoft, IBM: Multimedia Programming Interface and Data Specifications 1.0, 1991.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

namespace clamor {

// Encodings of samples, and the length of a chunk that is open or stands in the chunk "ds64".
inline constexpr std::uint16_t kWavPcm = 1, kWavFloat = 3, kWavExtensible = 0xfffe;
inline constexpr std::uint32_t kUnknownWavLength = 0xffffffff;

struct WavShape {
  int channels = 2, rate_hz = 48000;
  int bits = 32;
  bool is_float = true;
  std::optional<std::uint32_t> channel_mask{};  // unset: a header without channel mask

  std::size_t frame_bytes() const { return static_cast<std::size_t>(channels * bits / 8); }
};

// `data_bytes` is the size of the samples, or none if it is unknown and the header cannot be
// rewritten: readers then read to the end of the stream.
std::vector<std::byte> wav_header(const WavShape& shape, std::optional<std::uint64_t> data_bytes);

}  // namespace clamor
