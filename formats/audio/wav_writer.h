// wav_writer.h: writes sound files: WAV in four sample formats, or FLAC if the path ends in .flac.
//
// Full scale is +-1. Integer samples are rounded to nearest and clamped; 16-bit samples get
// triangular dither (TPDF, the sum of two uniform random numbers of one step each), so quiet sounds
// fade into noise instead of distortion. The dither is a function of frame and channel, and no file
// contains a time stamp: the same sound is the same bytes.
//
// A WAV file reserves room for RF64 lengths (wav_header.h) and becomes RF64 beyond 4 GiB. Devices,
// pipes and /dev/stdout are written as WAV unless their name ends in .flac (output_target.h).
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

// An Error if a file of that name cannot hold so many channels: it is no stream and ends in neither
// .wav nor .flac, or it is .flac with more than 8 channels.
Result<void> check_sound_file(const std::string& path, int channels);

// Parses "float", "32", "24" or "16"; empty selects the default of the file: float in WAV, 24 bit
// in FLAC. An Error if the file cannot hold the format.
Result<SampleFormat> sample_format(std::string_view name, const std::string& path);

// Loudspeaker position of a channel, as in the mask of WAVE_FORMAT_EXTENSIBLE.
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
  kWhenComplete,  // temporary until finish(), removed without it
  kAtOnce,        // at its final path from the first write on, always playable
};

// A growing sound file.
//
// A WAV recording (Appearance::kAtOnce) is valid after every write, because the header is updated.
// The FLAC encoder holds back up to 4096 frames, and only finish() stores the length; without it,
// readers play to the end of the data. A stream gets a WAV header of unknown length and accepts no
// FLAC.
class WavWriter {
 public:
  // `speakers`, one per channel in the order of their bits, are stored as a channel mask. Without
  // them, mono and stereo get a plain header, and more channels a mask of 0, which marks components
  // instead of loudspeakers, as AmbiX requires.
  static Result<WavWriter> create(const std::string& path, int channels, int rate_hz,
                                  SampleFormat format, std::span<const Speaker> speakers = {},
                                  Appearance appearance = Appearance::kWhenComplete);
  WavWriter(WavWriter&&) noexcept;
  WavWriter& operator=(WavWriter&&) noexcept;
  ~WavWriter();

  // `interleaved` must hold whole frames.
  Result<void> write(std::span<const float> interleaved);
  Result<void> finish();

 private:
  struct State;
  explicit WavWriter(std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

}  // namespace clamor
