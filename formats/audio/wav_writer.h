// wav_writer.h: sound files out: WAV in four sample formats, or FLAC where the path ends in .flac.
//
// Samples of +-1 are full scale. Whole numbers are rounded to nearest and kept within their range;
// 16 bit is dithered first, with the sum of two uniform random numbers of one step each (TPDF), so
// that quiet sounds fade into noise instead of distortion. The dither is a function of frame and
// channel, and no file holds the time of day: the same sound is the same bytes.
//
// A WAV file has room for RF64's lengths in its header (wav_header.h) and becomes RF64 where it
// exceeds 4 GiB. A device, a pipe or /dev/stdout takes a sound as well, as WAV unless its name ends
// in .flac (output_target.h).
//
// S. P. Lipshitz, R. A. Wannamaker, J. Vanderkooy. Quantization and Dither: A Theoretical Survey.
// J. Audio Eng. Soc. 40(5), 1992.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>

#include "common/result.h"

namespace clamor {

enum class SampleFormat { kFloat32, kPcm32, kPcm24, kPcm16 };

// An Error where no file of that name holds so many channels: its ending is neither .wav nor .flac
// and it is no stream, or it is .flac and they are more than 8.
Result<void> check_sound_file(const std::string& path, int channels);

// "float", "32", "24" or "16"; empty for the usual one of the file: float in WAV, 24 bit in FLAC.
// An Error where the file cannot hold it.
Result<SampleFormat> sample_format(std::string_view name, const std::string& path);

// What a channel is for, by the bits of WAVE_FORMAT_EXTENSIBLE.
enum class Speaker : std::uint32_t {
  kFrontLeft = 0x1,
  kFrontRight = 0x2,
  kFrontCentre = 0x4,
  kLowFrequency = 0x8,
  kBackLeft = 0x10,
  kBackRight = 0x20,
  kSideLeft = 0x200,
  kSideRight = 0x400,
  kTopFrontLeft = 0x1000,
  kTopFrontRight = 0x4000,
  kTopBackLeft = 0x8000,
  kTopBackRight = 0x20000,
};

enum class Appearance {
  kWhenComplete,  // under a temporary name until then; without finish(), nothing stays behind
  kAtOnce,        // under its own name from the first write on, and playable whatever happens
};

// A sound file that grows.
//
// Of a recording (Appearance::kAtOnce) WAV files are complete after every write: the header always
// tells how long the sound is. In FLAC files the encoder holds back up to 4096 frames, and their
// length is only told by finish(); without it, readers play to the end of what is there. A stream
// gets a WAV header that leaves the length open, and takes no FLAC.
class WavWriter {
 public:
  // `speakers`, one a channel and in the order of their bits, go into the header as a channel mask.
  // Without any, mono and stereo get a plain header, and more channels a mask of 0: no loudspeakers
  // but components, as AmbiX wants it.
  static Result<WavWriter> create(const std::string& path, int channels, int rate_hz,
                                  SampleFormat format, std::span<const Speaker> speakers = {},
                                  Appearance appearance = Appearance::kWhenComplete);
  WavWriter(WavWriter&&) noexcept;
  WavWriter& operator=(WavWriter&&) noexcept;
  ~WavWriter();

  // Whole frames.
  Result<void> write(std::span<const float> interleaved);
  Result<void> finish();

 private:
  struct State;
  explicit WavWriter(std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

}  // namespace clamor
