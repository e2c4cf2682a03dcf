// wav_header.h: the bytes before the samples of a WAV file, for any length.
//
//   RIFF (RF64)   size of what follows, "WAVE"
//   JUNK (ds64)   28 bytes that hold lengths of 64 bits once 32 bits are too few
//   fmt           16 bytes for whole numbers, 18 for floats, 40 with a channel mask
//   fact          for floats: the number of frames
//   data          size of the samples, which follow
//
// The size of the header does not depend on the length of the sound, so a file that grows keeps its
// samples where they are and only has its header written again.
//
// EBU Tech 3306: RF64, an Extended File Format for Audio. Geneva, 2009.
// Microsoft, IBM: Multimedia Programming Interface and Data Specifications 1.0, 1991.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

namespace clamor {

struct WavShape {
  int channels = 2, rate_hz = 48000;
  int bits = 32;
  bool is_float = true;
  std::optional<std::uint32_t> channel_mask{};  // unset: a plain header without one

  std::size_t frame_bytes() const { return static_cast<std::size_t>(channels * bits / 8); }
};

// For so many bytes of samples; none where the length is not known and the header cannot be written
// again: readers then take the samples until their end.
std::vector<std::byte> wav_header(const WavShape& shape, std::optional<std::uint64_t> data_bytes);

}  // namespace clamor
