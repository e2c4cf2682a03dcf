// sound_stream.h: reads the samples of a sound file in memory from its beginning to its end.
//
// WAV (whole numbers of 8 to 32 bits, floats) and FLAC are read here. Where libsndfile is built in
// (CLAMOR_WITH_SNDFILE), it reads all files, among them Ogg and MP3; both give the same samples.
//
// Threads: each object on one thread at a time.
#pragma once

#include <cstddef>
#include <memory>
#include <span>
#include <string>

#include "common/result.h"

namespace clamor {

class SoundStream {
 public:
  virtual ~SoundStream() = default;

  // Fills whole frames, full scale being +-1. Returns fewer than asked for, or 0, at the end.
  virtual std::size_t read(std::span<float> interleaved) = 0;
  // Why the samples end early, or "".
  virtual std::string problem() const = 0;

  int channels = 0;
  int rate_hz = 0;
};

// The file must outlive the stream. The Error is a sentence without the file's name.
Result<std::unique_ptr<SoundStream>> open_sound(std::span<const std::byte> file);

// Never uses libsndfile.
Result<std::unique_ptr<SoundStream>> open_wav_or_flac(std::span<const std::byte> file);

}  // namespace clamor
