#include "formats/audio/audio_file.h"

#include <algorithm>
#include <cmath>
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

TEST_F(AudioFiles, ThatAreInvalidAreRejected) {
  const std::string whole = wav(1000);
  for (const std::size_t size : {std::size_t{0}, std::size_t{1}, std::size_t{12}, std::size_t{44}})
    EXPECT_FALSE(read_audio(write("cut.wav", whole.substr(0, size))).ok()) << size;
  EXPECT_FALSE(read_audio(write("text.wav", "this is no sound")).ok());
  EXPECT_FALSE(read_audio(folder_ + "/missing.wav").ok());
  EXPECT_FALSE(read_audio(folder_).ok());
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
