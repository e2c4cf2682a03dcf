#include "formats/audio/audio_file.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <fstream>

#include "formats/audio/wav_writer.h"
#include "tests/formats/level_builder.h"

namespace clamor::testing {
namespace {

class AudioFiles : public LevelTest {};

TEST_F(AudioFiles, OfOtherRatesAreResampledWithoutChangingATone) {
  const auto samples = read_audio(write("tone.wav", wav(44100, 44100)));
  ASSERT_TRUE(samples.ok());
  ASSERT_NEAR(static_cast<double>(samples->size()), 48000, 1);
  double worst = 0;
  for (std::size_t i = 2000; i < 46000; ++i)
    worst = std::max(worst, std::fabs((*samples)[i] - 0.5 * std::sin(2 * M_PI * i / 48.0)));
  EXPECT_LT(worst, 4e-5);  // half a step of 16 bits is 1.5e-5
}

TEST_F(AudioFiles, SurviveFlacTo24Bits) {
  std::vector<float> samples;
  for (int i = 0; i < 5000; ++i) samples.push_back(static_cast<float>(std::sin(i * 0.1)));
  const auto flac = encode_flac(samples);
  ASSERT_TRUE(flac.ok()) << flac.error().message;
  const auto back = decode_audio(*flac, "flac");
  ASSERT_TRUE(back.ok());
  ASSERT_EQ(back->size(), samples.size());
  for (std::size_t i = 0; i < samples.size(); ++i) ASSERT_NEAR((*back)[i], samples[i], 3e-7);
  EXPECT_FALSE(encode_flac(std::vector<float>{1.01f}).ok());
  EXPECT_FALSE(encode_flac(std::vector<float>{NAN}).ok());
}

// The encoder of FLAC 1.4 writes 20 and 32 bits, where the WAV file has them.
TEST_F(AudioFiles, OfFlacWithOtherBitsAreRejectedWithTheirNumber) {
  const auto flac = encode_flac(std::vector<float>(5000, 0.5f));
  ASSERT_TRUE(flac.ok());
  for (const unsigned bits : {12u, 20u, 32u}) {
    auto changed = *flac;  // STREAMINFO ends with 20 bits of rate, 3 of channels and 5 of bits
    changed[20] = (changed[20] & std::byte{0xfe}) | static_cast<std::byte>((bits - 1) >> 4);
    changed[21] = (changed[21] & std::byte{0x0f}) | static_cast<std::byte>((bits - 1) << 4 & 0xff);
    const auto read = decode_audio(changed, "kick.flac");
    ASSERT_FALSE(read.ok()) << bits;
    EXPECT_EQ(read.error().message.find("kick.flac: is FLAC of " + std::to_string(bits)), 0u)
        << read.error().message;
  }
}

TEST_F(AudioFiles, ThatAreInvalidAreRejected) {
  const std::string whole = wav(1000);
  for (const std::size_t size : {std::size_t{0}, std::size_t{1}, std::size_t{12}, std::size_t{44}})
    EXPECT_FALSE(read_audio(write("cut.wav", whole.substr(0, size))).ok()) << size;
  EXPECT_FALSE(read_audio(write("text.wav", "this is no sound")).ok());
  EXPECT_FALSE(read_audio(folder_ + "/missing.wav").ok());
  EXPECT_FALSE(read_audio(folder_).ok());
}

// Two channels of the tone, the second times `factor`.
std::string stereo(double factor, double gain = 1) {
  const std::string mono = wav(4800);
  std::string both = mono.substr(0, 44);
  both[22] = 2;  // channels
  both[32] = 4;  // bytes a frame
  for (std::size_t at = 44; at < mono.size(); at += 2) {
    std::int16_t left;
    std::memcpy(&left, mono.data() + at, 2);
    left = static_cast<std::int16_t>(gain * left);
    const auto right = static_cast<std::int16_t>(factor * left);
    both.append(reinterpret_cast<const char*>(&left), 2);
    both.append(reinterpret_cast<const char*>(&right), 2);
  }
  const auto bytes = static_cast<std::uint32_t>(both.size() - 44);
  std::memcpy(both.data() + 40, &bytes, 4);
  return both;
}

// The mean of x and f x has the power ((1 + f) / 2)^2 of x, the channels have (1 + f^2) / 2.
TEST_F(AudioFiles, WhoseChannelsCancelAreReported) {
  const auto downmix = [](const std::string& file) {
    Downmix found;
    EXPECT_TRUE(decode_audio(std::as_bytes(std::span(file)), "x.wav", &found).ok());
    return found;
  };
  for (const double factor : {1.0, 0.5, 0.0, -0.25}) {
    const Downmix found = downmix(stereo(factor));
    const double mean = (1 + factor) / 2, channels = (1 + factor * factor) / 2;
    EXPECT_NEAR(found.loss_db, 10 * std::log10(channels / (mean * mean)), 0.01) << factor;
    EXPECT_EQ(found.warning("x.wav").empty(), found.loss_db < 6) << factor;
    EXPECT_NE(found.note("x.wav").find("2 channels of 'x.wav'"), std::string::npos);
  }
  EXPECT_NE(downmix(stereo(-0.5)).warning("x.wav").find("'x.wav' becomes 10 dB quieter"),
            std::string::npos);
  EXPECT_NE(downmix(stereo(-1)).warning("x.wav").find("'x.wav' is silent when its 2 channels"),
            std::string::npos);
}

TEST_F(AudioFiles, WithoutSoundAreReported) {
  Downmix downmix;
  const std::string zeros = stereo(0, 0);
  ASSERT_TRUE(decode_audio(std::as_bytes(std::span(zeros)), "x.wav", &downmix).ok());
  EXPECT_NE(downmix.warning("x.wav").find("'x.wav' is silent: all its samples"), std::string::npos);
  const std::string quiet = stereo(1, 0.001);
  ASSERT_TRUE(decode_audio(std::as_bytes(std::span(quiet)), "x.wav", &downmix).ok());
  EXPECT_EQ(downmix.warning("x.wav"), "") << "quiet, but a sound";
}

TEST_F(AudioFiles, AppearAtomicallyAndAreDeterministic) {
  const std::string path = folder_ + "/out.wav";
  const std::vector<float> samples = {0.5f, -0.5f, 0.25f, 2.0f};
  {
    auto writer = WavWriter::create(path, 2, 48000, SampleFormat::kFloat32);
    ASSERT_TRUE(writer.ok()) << writer.error().message;
    ASSERT_TRUE(writer->write(samples).ok());
  }
  EXPECT_TRUE(std::filesystem::is_empty(folder_));
  std::string bytes[2];
  for (std::string& text : bytes) {
    auto writer = WavWriter::create(path, 2, 48000, SampleFormat::kFloat32);
    ASSERT_TRUE(writer->write(samples).ok());
    ASSERT_TRUE(writer->finish().ok());
    std::ifstream in(path, std::ios::binary);
    text.assign(std::istreambuf_iterator<char>(in), {});
  }
  EXPECT_EQ(bytes[0], bytes[1]);
  EXPECT_EQ(std::distance(std::filesystem::directory_iterator(folder_), {}), 1);
  EXPECT_FALSE(WavWriter::create(folder_ + "/none/x.wav", 1, 48000, SampleFormat::kPcm16).ok());
  EXPECT_FALSE(WavWriter::create(folder_, 1, 48000, SampleFormat::kPcm16).ok());
}

}  // namespace
}  // namespace clamor::testing
