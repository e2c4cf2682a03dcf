#include "formats/audio/sound_stream.h"

#include <cmath>
#include <cstdio>
#include <cstring>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <sndfile.h>

#include "formats/audio/audio_file.h"

namespace clamor::testing {
namespace {

// A file that libsndfile writes.
std::string sound_file(int format, int channels, int rate_hz, const std::vector<float>& samples) {
  std::FILE* const temporary = std::tmpfile();
  SF_INFO info{};
  info.channels = channels;
  info.samplerate = rate_hz;
  info.format = format;
  SNDFILE* const file = sf_open_fd(fileno(temporary), SFM_WRITE, &info, SF_FALSE);
  EXPECT_NE(file, nullptr) << sf_strerror(nullptr);
  sf_command(file, SFC_SET_CLIPPING, nullptr, SF_TRUE);
  const auto count = static_cast<sf_count_t>(samples.size());
  EXPECT_EQ(sf_write_float(file, samples.data(), count), count);
  EXPECT_EQ(sf_close(file), 0);
  std::fseek(temporary, 0, SEEK_END);
  std::string bytes(static_cast<std::size_t>(std::ftell(temporary)), 0);
  std::rewind(temporary);
  EXPECT_EQ(std::fread(bytes.data(), 1, bytes.size(), temporary), bytes.size());
  std::fclose(temporary);
  return bytes;
}

// A tone with full-scale samples at its beginning.
std::string tone(int format, int channels, int frames) {
  std::vector<float> samples(static_cast<std::size_t>(channels * frames));
  for (std::size_t i = 0; i < samples.size(); ++i)
    samples[i] = i < 4 ? (i % 2 == 0 ? 1.0f : -1.0f)
                       : static_cast<float>(std::sin(0.1 * static_cast<double>(i)));
  return sound_file(format, channels, 44100, samples);
}

std::vector<float> all_of(SoundStream& stream) {
  std::vector<float> all, block(static_cast<std::size_t>(100 * stream.channels));
  while (const std::size_t frames = stream.read(block))
    all.insert(all.end(), block.begin(),
               block.begin() + static_cast<std::ptrdiff_t>(frames) * stream.channels);
  return all;
}

void expect_both_agree(const std::string& file, const std::string& what) {
  const auto bytes = std::as_bytes(std::span(file));
  const auto by_sndfile = open_sound(bytes), here = open_wav_or_flac(bytes);
  ASSERT_TRUE(by_sndfile.ok()) << what;
  ASSERT_TRUE(here.ok()) << what << ": " << here.error().message;
  EXPECT_EQ((*here)->channels, (*by_sndfile)->channels) << what;
  EXPECT_EQ((*here)->rate_hz, (*by_sndfile)->rate_hz) << what;
  const std::vector<float> samples = all_of(**here);
  EXPECT_FALSE(samples.empty()) << what;
  EXPECT_EQ(samples, all_of(**by_sndfile)) << what;
  EXPECT_EQ((*here)->problem(), "") << what;
}

TEST(SoundStreams, GiveTheSamplesThatLibsndfileGives) {
  for (const int container : {SF_FORMAT_WAV, SF_FORMAT_WAVEX, SF_FORMAT_RF64, SF_FORMAT_FLAC})
    for (const int encoding :
         {SF_FORMAT_PCM_U8, SF_FORMAT_PCM_S8, SF_FORMAT_PCM_16, SF_FORMAT_PCM_24, SF_FORMAT_PCM_32,
          SF_FORMAT_FLOAT, SF_FORMAT_DOUBLE})
      for (const int channels : {1, 2, 6}) {
        SF_INFO info{};
        info.channels = channels;
        info.samplerate = 44100;
        info.format = container | encoding;
        if (sf_format_check(&info) == 0) continue;
        const std::string what =
            std::to_string(container | encoding) + " of " + std::to_string(channels) + " channels";
        expect_both_agree(tone(container | encoding, channels, 4999), what);
      }
}

TEST(SoundStreams, OfFilesThatEndEarlyHaveTheSamplesThatTheFilesHave) {
  for (const int encoding : {SF_FORMAT_PCM_16, SF_FORMAT_PCM_24, SF_FORMAT_FLOAT}) {
    const std::string whole = tone(SF_FORMAT_WAV | encoding, 2, 1000);
    for (const std::size_t less : {1u, 7u, 8u, 500u})
      expect_both_agree(whole.substr(0, whole.size() - less), std::to_string(less) + " less");
  }
  const std::string flac = tone(SF_FORMAT_FLAC | SF_FORMAT_PCM_24, 1, 20000);
  const auto cut = open_wav_or_flac(std::as_bytes(std::span(flac).first(flac.size() / 2)));
  ASSERT_TRUE(cut.ok());
  EXPECT_LT(all_of(**cut).size(), 20000u);
}

TEST(SoundStreams, ReportBrokenFlac) {
  std::string flac = tone(SF_FORMAT_FLAC | SF_FORMAT_PCM_24, 1, 20000);
  flac[flac.size() / 2] = static_cast<char>(flac[flac.size() / 2] ^ 4);
  const auto broken = open_wav_or_flac(std::as_bytes(std::span(flac)));
  ASSERT_TRUE(broken.ok());
  all_of(**broken);
  EXPECT_NE((*broken)->problem(), "");
}

// Bakes made before libFLAC was called directly hold these bytes.
TEST(SoundStreams, AreEncodedAsLibsndfileEncodesThem) {
  std::vector<float> samples;
  for (int i = 0; i < 20000; ++i) samples.push_back(static_cast<float>(std::sin(0.03 * i * i)));
  samples[7] = 1;
  const auto flac = encode_flac(samples);
  ASSERT_TRUE(flac.ok());
  const std::string bytes = sound_file(SF_FORMAT_FLAC | SF_FORMAT_PCM_24, 1, 48000, samples);
  ASSERT_EQ(bytes.size(), flac->size());
  EXPECT_EQ(std::memcmp(bytes.data(), flac->data(), bytes.size()), 0);
}

TEST(WavOrFlac, RefusesAllElse) {
  const std::string wav("RIFF\x40\0\0\0WAVEfmt \x10\0\0\0", 20);
  for (const std::string& file : {std::string(), std::string("OggS0123456789"), std::string("fLaC"),
                                  std::string("RIFF"), wav, std::string(64, 'x')})
    EXPECT_FALSE(open_wav_or_flac(std::as_bytes(std::span(file))).ok()) << file;
}

}  // namespace
}  // namespace clamor::testing
