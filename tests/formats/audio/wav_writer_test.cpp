#include "formats/audio/wav_writer.h"

#include <algorithm>

#include <fcntl.h>
#include <signal.h>
#include <sndfile.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include "tests/formats/wav_files.h"

namespace clamor {
namespace {

TEST_F(WavFiles, RoundTripWithinHalfAQuantizationStep) {
  const std::vector<float> samples = sweep(5000);
  struct Case {
    const char* name;
    SampleFormat format;
    double worst;  // 1 is full scale
  };
  // Dither may add one step to the rounding error; floats have 24 significant bits.
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

TEST_F(WavFiles, ClampSamplesBeyondFullScale) {
  for (const SampleFormat format :
       {SampleFormat::kPcm32, SampleFormat::kPcm24, SampleFormat::kPcm16}) {
    written("x.wav", {3, -3, 1, -1}, 1, format);
    const auto read = read_audio(folder_ / "x.wav");
    ASSERT_TRUE(read.ok());
    for (std::size_t i = 0; i < 4; ++i) EXPECT_NEAR((*read)[i], i % 2 == 0 ? 1 : -1, 1e-4) << i;
  }
}

// A tone with an amplitude of a third of a step vanishes if rounded and remains if dithered. The
// error is noise that is independent of the sample, with the variance of rounding plus two
// uniforms, 1 / 4.
TEST_F(WavFiles, OfSixteenBitsPreserveTonesBelowOneStepByDither) {
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

TEST_F(WavFiles, AreDeterministic) {
  for (const char* name : {"x.wav", "x.flac"}) {
    const std::string first = written(name, sweep(3000), 2, SampleFormat::kPcm16);
    EXPECT_EQ(first, written(name, sweep(3000), 2, SampleFormat::kPcm16));
    EXPECT_GT(first.size(), 100u);
  }
}

TEST_F(WavFiles, StoreLoudspeakerPositionsInTheHeader) {
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
    const std::size_t format = bytes.find("fmt ");
    EXPECT_EQ(number_at(bytes, format + 8, 2), 0xFFFEu) << "WAVE_FORMAT_EXTENSIBLE";
    EXPECT_EQ(number_at(bytes, format + 10, 2), count);
    EXPECT_EQ(number_at(bytes, format + 28, 4), mask);
  }
  // 16 components without loudspeaker positions.
  const std::string ambix = written("x.wav", std::vector<float>(64), 16, SampleFormat::kFloat32);
  const std::size_t format = ambix.find("fmt ");
  EXPECT_EQ(number_at(ambix, format + 8, 2), 0xFFFEu);
  EXPECT_EQ(number_at(ambix, format + 10, 2), 16u);
  EXPECT_EQ(number_at(ambix, format + 28, 4), 0u);
}

TEST_F(WavFiles, FollowLinksAndStoreTheLengthInPipes) {
  fs::create_directory(folder_ / "elsewhere");
  fs::create_symlink("elsewhere/real.wav", folder_ / "link.wav");
  written("link.wav", sweep(500), 1, SampleFormat::kFloat32);
  EXPECT_TRUE(fs::is_symlink(folder_ / "link.wav"));
  EXPECT_EQ(read_audio(folder_ / "elsewhere/real.wav")->size(), 500u);

  const std::string pipe = folder_ / "pipe";
  ASSERT_EQ(::mkfifo(pipe.c_str(), 0600), 0);
  const int reader = ::open(pipe.c_str(), O_RDONLY | O_NONBLOCK);
  auto writer = WavWriter::create(pipe, 1, 48000, SampleFormat::kPcm16);
  ASSERT_TRUE(writer.ok()) << writer.error().message;
  ASSERT_TRUE(writer->write(std::vector<float>(1000, 0.25f)).ok());
  ASSERT_TRUE(writer->finish().ok());
  std::string bytes(100000, '\0');
  bytes.resize(
      static_cast<std::size_t>(std::max<ssize_t>(0, ::read(reader, bytes.data(), 100000))));
  ::close(reader);
  EXPECT_EQ(number_at(bytes, 4, 4) + 8, bytes.size());
  EXPECT_TRUE(fs::is_fifo(pipe));
}

TEST_F(WavFiles, RemoveTemporariesOfKilledProcesses) {
  const std::string path = folder_ / "x.wav";
  const pid_t child = ::fork();
  if (child == 0) {
    auto writer = WavWriter::create(path, 1, 48000, SampleFormat::kFloat32);
    const bool ok = writer.ok() && writer->write(std::vector<float>(100)).ok();
    ::raise(ok ? SIGKILL : SIGTERM);
  }
  int status = 0;
  ASSERT_EQ(::waitpid(child, &status, 0), child);
  ASSERT_EQ(WTERMSIG(status), SIGKILL);
  EXPECT_FALSE(fs::exists(path));
  EXPECT_FALSE(fs::is_empty(folder_));
  written("x.wav", sweep(100), 1, SampleFormat::kFloat32);
  EXPECT_EQ(std::distance(fs::directory_iterator(folder_), fs::directory_iterator{}), 1);
}

TEST_F(WavFiles, RequireAKnownExtension) {
  for (const char* name : {"x.mp3", "x.ogg", "x", "wav", "x.wav.part", ""}) {
    EXPECT_FALSE(WavWriter::create(folder_ / name, 2, 48000, SampleFormat::kFloat32).ok()) << name;
    EXPECT_FALSE(check_sound_file(name, 2).ok()) << name;
  }
  for (const char* name : {"x.wav", "x.WAV", "some.where/x.flac"})
    EXPECT_TRUE(check_sound_file(name, 8).ok()) << name;
  EXPECT_TRUE(check_sound_file("x.wav", 16).ok());
  EXPECT_FALSE(check_sound_file("x.flac", 9).ok());
}

TEST_F(WavFiles, ExplainTheLimitsOfFlac) {
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
