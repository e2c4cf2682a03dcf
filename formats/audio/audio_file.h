// audio_file.h: sound files in, and FLAC in memory. libsoxr is visible only here, libsndfile also
// in wav_writer.cpp.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "common/result.h"
#include "formats/audio/wav_writer.h"

namespace clamor {

// Mono at kSampleRate_hz: channels are averaged, other rates resampled (soxr, very high quality).
// At most 30 minutes; NaN and Inf are refused.
Result<std::vector<float>> read_audio(const std::string& path);
// `channels`, unless null, becomes how many the file has.
Result<std::vector<float>> decode_audio(std::span<const std::byte> file, const std::string& name,
                                        int* channels = nullptr);

// "all but the mean of the 2 channels of 'x.wav' ...": what an import ignored of such a sound.
std::string downmix_note(const std::string& name, int channels);

// The sound of a FLAC stream as encode_flac() makes them, and of no other file. Decodes at most
// `max_frames` + 1 frames and allocates no more, whatever the stream holds. An Error is half a
// sentence: "is no FLAC stream".
Result<std::vector<float>> decode_flac(std::span<const std::byte> flac, std::uint64_t max_frames);

// A sound with its channels apart, at kSampleRate_hz, all of one length.
struct Sound {
  std::vector<std::vector<float>> channels;
  int file_rate_hz = 0;   // what it had before it was resampled
  int file_channels = 0;  // and before they were averaged

  std::size_t frames() const { return channels.empty() ? 0 : channels.front().size(); }
};

// At most `max_channels` channels; otherwise as read_audio().
Result<Sound> read_channels(const std::string& path, int max_channels);

// FLAC, 24 bit, one channel, at kSampleRate_hz: how signals are kept in a bake file. Full scale
// is +-1; louder samples are an Error.
Result<std::vector<std::byte>> encode_flac(std::span<const float> samples);

// "libsndfile 1.2.0", "libsoxr 0.1.3".
std::vector<std::string> sound_library_versions();

}  // namespace clamor
