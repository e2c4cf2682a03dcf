#include "formats/wav_writer.h"

#include <cmath>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <numbers>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <sndfile.h>

#include "formats/audio_file.h"

namespace clamor {
namespace {

namespace fs = std::filesystem;

class WavFiles : public ::testing::Test {
 protected:
  WavFiles() {
    std::string name = (fs::temp_directory_path() / "clamor_wav_XXXXXX").string();
    folder_ = ::mkdtemp(name.data());
  }
  ~WavFiles() override { fs::remove_all(folder_); }

  // The whole file.
  std::string written(const std::string& name, const std::vector<float>& samples, int channels,
                      SampleFormat format, std::span<const Speaker> speakers = {}) {
    const std::string path = folder_ / name;
    auto writer = WavWriter::create(path, channels, 48000, format, speakers);
    EXPECT_TRUE(writer.ok()) << writer.error().message;
    if (!writer.ok()) return "";
    // In two parts, as blocks come.
    const std::size_t half = samples.size() / 2 / static_cast<std::size_t>(channels) *
                             static_cast<std::size_t>(channels);
    EXPECT_TRUE(writer->write(std::span(samples).first(half)).ok());
    EXPECT_TRUE(writer->write(std::span(samples).subspan(half)).ok());
    EXPECT_TRUE(writer->finish().ok());
    std::ifstream in(path, std::ios::binary);
    return {std::istreambuf_iterator<char>(in), {}};
  }

  fs::path folder_;
};

std::uint32_t number_at(const std::string& bytes, std::size_t at, int size) {
  std::uint32_t number = 0;
  for (int i = size; i-- > 0;)
    number = number << 8 | static_cast<unsigned char>(bytes[at + static_cast<std::size_t>(i)]);
  return number;
}

std::vector<float> sweep(std::size_t frames) {
  std::vector<float> samples;
  for (std::size_t i = 0; i < frames; ++i)
    samples.push_back(static_cast<float>(0.9 * std::sin(1e-5 * static_cast<double>(i * i))));
  return samples;
}

TEST_F(WavFiles, GiveBackWhatWasWrittenWithinHalfAStepOfTheirBits) {
  const std::vector<float> samples = sweep(5000);
  struct Case {
    const char* name;
    SampleFormat format;
    double worst;  // 1 is full scale
  };
  // Dither may add a step to the rounding; floats of 32 bits have 24 that count.
  for (const auto& [name, format, worst] :
       {Case{"a.wav", SampleFormat::kFloat32, 0}, Case{"b.wav", SampleFormat::kPcm32, 0x1p-24},
        Case{"c.wav", SampleFormat::kPcm24, 0x1p-24},
        Case{"d.wav", SampleFormat::kPcm16, 0x1.8p-15},
        Case{"e.flac", SampleFormat::kPcm24, 0x1p-24},
        Case{"f.FLAC", SampleFormat::kPcm16, 0x1.8p-15}}) {
    written(name, samples, 1, format);
    const auto read = read_audio(folder_ / name);
    ASSERT_TRUE(read.ok()) << read.error().message;
    ASSERT_EQ(read->size(), samples.size());
    double most = 0;
    for (std::size_t i = 0; i < samples.size(); ++i)
      most = std::max(most, static_cast<double>(std::abs((*read)[i] - samples[i])));
    EXPECT_LE(most, worst) << name;
  }
}

TEST_F(WavFiles, KeepSamplesBeyondFullScaleAtFullScale) {
  for (const SampleFormat format :
       {SampleFormat::kPcm32, SampleFormat::kPcm24, SampleFormat::kPcm16}) {
    written("x.wav", {3, -3, 1, -1}, 1, format);
    const auto read = read_audio(folder_ / "x.wav");
    ASSERT_TRUE(read.ok());
    for (std::size_t i = 0; i < 4; ++i) EXPECT_NEAR((*read)[i], i % 2 == 0 ? 1 : -1, 1e-4) << i;
  }
}

// A tone of a third of a step vanishes when it is rounded and stays when it is dithered, and the
// error is noise: as large for any sample, and of the variance of rounding and two uniforms, 1 / 4.
TEST_F(WavFiles, OfSixteenBitsKeepWhatIsQuieterThanOneStep) {
  constexpr std::size_t kFrames = 96000;
  std::vector<float> quiet;
  const auto tone = [](std::size_t i) {
    return std::sin(2 * std::numbers::pi * static_cast<double>(i) / 48);
  };
  for (std::size_t i = 0; i < kFrames; ++i)
    quiet.push_back(static_cast<float>(tone(i) / 3 / 32768));
  written("quiet.wav", quiet, 1, SampleFormat::kPcm16);
  const auto read = read_audio(folder_ / "quiet.wav");
  ASSERT_TRUE(read.ok());
  double in_phase = 0, variance = 0;
  for (std::size_t i = 0; i < kFrames; ++i) {
    in_phase += 32768 * static_cast<double>((*read)[i]) * tone(i) * 2 / kFrames;
    variance += std::pow(32768 * static_cast<double>((*read)[i] - quiet[i]), 2) / kFrames;
  }
  // Standard deviations of both estimates are 0.0023 and 0.0015.
  EXPECT_NEAR(in_phase, 1.0 / 3, 0.01);
  EXPECT_NEAR(variance, 0.25, 0.006);
}

TEST_F(WavFiles, AreTheSameBytesEachTime) {
  for (const char* name : {"x.wav", "x.flac"}) {
    const std::string first = written(name, sweep(3000), 2, SampleFormat::kPcm16);
    EXPECT_EQ(first, written(name, sweep(3000), 2, SampleFormat::kPcm16));
    EXPECT_GT(first.size(), 100u);
  }
}

TEST_F(WavFiles, SayInTheirHeaderWhichLoudspeakerAChannelIs) {
  using enum Speaker;
  const std::vector<Speaker> all = {kFrontLeft,    kFrontRight,    kFrontCentre, kLowFrequency,
                                    kBackLeft,     kBackRight,     kSideLeft,    kSideRight,
                                    kTopFrontLeft, kTopFrontRight, kTopBackLeft, kTopBackRight};
  for (const std::size_t count : {6u, 8u, 12u}) {
    const std::vector<float> samples(count * 4);
    const std::string bytes = written("x.wav", samples, static_cast<int>(count),
                                      SampleFormat::kPcm24, std::span(all).first(count));
    std::uint32_t mask = 0;
    for (std::size_t c = 0; c < count; ++c) mask |= static_cast<std::uint32_t>(all[c]);
    EXPECT_EQ(number_at(bytes, 20, 2), 0xFFFEu) << "WAVE_FORMAT_EXTENSIBLE";
    EXPECT_EQ(number_at(bytes, 22, 2), count);
    EXPECT_EQ(number_at(bytes, 40, 4), mask);
  }
  // 16 components of no loudspeaker.
  const std::string ambix = written("x.wav", std::vector<float>(64), 16, SampleFormat::kFloat32);
  EXPECT_EQ(number_at(ambix, 20, 2), 0xFFFEu);
  EXPECT_EQ(number_at(ambix, 22, 2), 16u);
  EXPECT_EQ(number_at(ambix, 40, 4), 0u);
}

TEST_F(WavFiles, AreOfNoKindThatTheirNameDoesNotSay) {
  for (const char* name : {"x.mp3", "x.ogg", "x", "wav", "x.wav.part", ""}) {
    EXPECT_FALSE(WavWriter::create(folder_ / name, 2, 48000, SampleFormat::kFloat32).ok()) << name;
    EXPECT_FALSE(check_sound_file(name, 2).ok()) << name;
  }
  for (const char* name : {"x.wav", "x.WAV", "some.where/x.flac"})
    EXPECT_TRUE(check_sound_file(name, 8).ok()) << name;
  EXPECT_TRUE(check_sound_file("x.wav", 16).ok());
  EXPECT_FALSE(check_sound_file("x.flac", 9).ok());
}

TEST_F(WavFiles, SayWhatAFlacFileCannotHold) {
  EXPECT_FALSE(WavWriter::create(folder_ / "x.flac", 12, 48000, SampleFormat::kPcm24).ok());
  EXPECT_FALSE(WavWriter::create(folder_ / "x.flac", 2, 48000, SampleFormat::kFloat32).ok());
  EXPECT_FALSE(sample_format("float", "x.flac").ok());
  EXPECT_FALSE(sample_format("32", "x.flac").ok());
  EXPECT_FALSE(sample_format("8", "x.wav").ok());
  EXPECT_EQ(*sample_format("", "x.flac"), SampleFormat::kPcm24);
  EXPECT_EQ(*sample_format("", "x.wav"), SampleFormat::kFloat32);
  EXPECT_EQ(*sample_format("32", "x.wav"), SampleFormat::kPcm32);
}

}  // namespace
}  // namespace clamor
