// audio_file.h: decodes sound files and encodes FLAC in memory. libsoxr is visible only here.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "common/result.h"
#include "formats/audio/wav_writer.h"

namespace clamor {

// Rates that are read.
inline constexpr int kMinSoundRate_hz = 1000, kMaxSoundRate_hz = 768000;

// Decodes to mono at kSampleRate_hz: channels are averaged, other rates resampled (soxr, very high
// quality). Sounds longer than 30 minutes and samples that are NaN or infinite are Errors.
Result<std::vector<float>> read_audio(const std::string& path);

// Effect of averaging the channels of a sound.
struct Downmix {
  int channels = 1;
  float peak = 0;      // of the mean
  double loss_db = 0;  // power of the mean relative to the mean power of the channels

  // "all but the mean of the 2 channels of 'x.wav' ...": what is ignored of a sound, or "".
  std::string note(const std::string& name) const;
  // "'x.wav' is silent ...": why a sound is hardly heard, or "".
  std::string warning(const std::string& name) const;
};

// Fills in `downmix` unless null.
Result<std::vector<float>> decode_audio(std::span<const std::byte> file, const std::string& name,
                                        Downmix* downmix = nullptr);

// Resamples as read_audio() does. The Error is a predicate: "has an unusable rate".
Result<std::vector<float>> resampled(std::span<const float> samples, int rate_hz);

// Decodes a stream of encode_flac(). Decodes at most `max_frames` + 1 frames and allocates no more,
// whatever the stream claims. The Error is a predicate: "is no FLAC stream".
Result<std::vector<float>> decode_flac(std::span<const std::byte> flac, std::uint64_t max_frames);

// Samples per channel, at kSampleRate_hz and of equal length.
struct Sound {
  std::vector<std::vector<float>> channels;
  int file_rate_hz = 0;  // before resampling
  Downmix downmix{};     // if the channels were averaged

  std::size_t frames() const { return channels.empty() ? 0 : channels.front().size(); }
};

// Reads at most `max_channels` channels; otherwise as read_audio().
Result<Sound> read_channels(const std::string& path, int max_channels);

// Encodes mono FLAC with 24 bits at kSampleRate_hz, as signals are stored in a bake file. Full
// scale is +-1; louder samples are an Error.
Result<std::vector<std::byte>> encode_flac(std::span<const float> samples);

// "libFLAC 1.4.2", "libsoxr 0.1.3".
std::vector<std::string> sound_library_versions();

}  // namespace clamor
