#include "formats/audio/wav_writer.h"

#include <cmath>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <numbers>
#include <string>
#include <vector>

#include <fcntl.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <sndfile.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include "formats/audio/audio_file.h"
#include "formats/audio/wav_header.h"

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

  // Returns the bytes of the file.
  std::string written(const std::string& name, const std::vector<float>& samples, int channels,
                      SampleFormat format, std::span<const Speaker> speakers = {}) {
    const std::string path = folder_ / name;
    auto writer = WavWriter::create(path, channels, 48000, format, speakers);
    EXPECT_TRUE(writer.ok()) << writer.error().message;
    if (!writer.ok()) return "";
    // Written in two blocks.
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

TEST_F(WavFiles, KeepSamplesBeyondFullScaleAtFullScale) {
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

// Non-PCM formats require an extension size, even if 0; sox warns if it is missing.
TEST_F(WavFiles, HaveAWholeFormatChunk) {
  const struct {
    SampleFormat format;
    int channels;
    std::uint32_t bytes, rest;
  } cases[] = {{SampleFormat::kPcm16, 2, 16, 0},
               {SampleFormat::kFloat32, 1, 18, 0},
               {SampleFormat::kFloat32, 2, 18, 0},
               {SampleFormat::kPcm24, 6, 40, 22}};
  for (const auto& [format, channels, bytes, rest] : cases) {
    const std::string file = written(
        "x.wav", std::vector<float>(4 * static_cast<std::size_t>(channels)), channels, format);
    const std::size_t chunk = file.find("fmt ");
    EXPECT_EQ(number_at(file, chunk + 4, 4), bytes);
    if (bytes > 16) {
      EXPECT_EQ(number_at(file, chunk + 24, 2), rest);
    }
    EXPECT_EQ(file.find("PEAK"), std::string::npos) << "it holds the time of day";
  }
}

// Chunks have even lengths, and their sizes sum to that of the file.
TEST_F(WavFiles, HaveSizesThatAddUp) {
  for (const std::size_t frames : {0u, 1u, 2u, 1001u}) {
    const std::string file =
        written("x.wav", std::vector<float>(frames, 0.5f), 1, SampleFormat::kPcm24);
    EXPECT_EQ(number_at(file, 4, 4) + 8, file.size());
    std::size_t at = 12, data = 0;
    while (at + 8 <= file.size()) {
      const std::uint32_t size = number_at(file, at + 4, 4);
      if (file.substr(at, 4) == "data") data = size;
      at += 8 + size + size % 2;
    }
    EXPECT_EQ(at, file.size());
    EXPECT_EQ(data, 3 * frames);
  }
}

// A sparse file: only its header and last frame occupy disk space.
TEST_F(WavFiles, BeyondFourGigabytesAreReadAsRf64) {
  const std::string path = folder_ / "long.wav";
  for (const bool is_float : {true, false}) {
    const WavShape shape{
        .channels = 2, .rate_hz = 48000, .bits = is_float ? 32 : 16, .is_float = is_float};
    const std::uint64_t short_frames = 0xffff'0000u / shape.frame_bytes();
    for (const std::uint64_t frames : {short_frames, 3 * short_frames}) {
      const auto header = wav_header(shape, frames * shape.frame_bytes());
      const std::string last(shape.frame_bytes(), '\x3f');
      {
        std::ofstream file(path, std::ios::binary);
        file.write(reinterpret_cast<const char*>(header.data()),
                   static_cast<std::streamsize>(header.size()));
        file.seekp(static_cast<std::streamoff>(header.size() + (frames - 1) * last.size()));
        file << last;
      }
      SF_INFO info{};
      SNDFILE* const sound = sf_open(path.c_str(), SFM_READ, &info);
      ASSERT_NE(sound, nullptr) << sf_strerror(nullptr);
      EXPECT_EQ(info.format & SF_FORMAT_TYPEMASK,
                frames == short_frames ? SF_FORMAT_WAV : SF_FORMAT_RF64);
      EXPECT_EQ(static_cast<std::uint64_t>(info.frames), frames);
      EXPECT_EQ(info.channels, 2);
      EXPECT_EQ(sf_seek(sound, static_cast<sf_count_t>(frames) - 1, SEEK_SET),
                static_cast<sf_count_t>(frames) - 1);
      float frame[2] = {};
      EXPECT_EQ(sf_readf_float(sound, frame, 2), 1);
      EXPECT_GT(frame[1], 0.4f);
      sf_close(sound);
    }
  }
}

// The switch to 64-bit lengths changes chunk names and sizes but moves no samples.
TEST_F(WavFiles, BecomeRf64WhereTheirSizeNeedsIt) {
  const WavShape shape{.channels = 1, .rate_hz = 48000, .bits = 16, .is_float = false};
  const std::uint64_t before = wav_header(shape, 0).size() - 8;
  const auto text = [&](std::uint64_t data) {
    const auto header = wav_header(shape, data);
    return std::string(reinterpret_cast<const char*>(header.data()), header.size());
  };
  const std::uint64_t largest = 0xffff'fffeu - before;
  EXPECT_EQ(text(largest).substr(0, 4), "RIFF");
  EXPECT_EQ(number_at(text(largest), 4, 4), 0xffff'fffeu);
  const std::string longer = text(largest + 2);
  EXPECT_EQ(longer.size(), text(largest).size());
  EXPECT_EQ(longer.substr(0, 4), "RF64");
  EXPECT_EQ(longer.substr(12, 4), "ds64");
  EXPECT_EQ(number_at(longer, 4, 4), 0xffff'ffffu);
  EXPECT_EQ(number_at(longer, 20, 4), 0u);  // 2^32
  EXPECT_EQ(number_at(longer, 24, 4), 1u);
}

class Recordings : public WavFiles {
 protected:
  static Result<WavWriter> record(const std::string& path, SampleFormat format) {
    return WavWriter::create(path, 2, 48000, format, {}, Appearance::kAtOnce);
  }

  // A player can read the file at this point.
  static std::size_t frames_in(const std::string& path) {
    const auto sound = read_channels(path, 2);
    return sound.ok() ? sound->frames() : 0;
  }

  std::size_t files() const {
    return static_cast<std::size_t>(
        std::distance(fs::directory_iterator(folder_), fs::directory_iterator{}));
  }
};

TEST_F(Recordings, CanBePlayedToTheirEndAtAnyMoment) {
  for (const SampleFormat format : {SampleFormat::kFloat32, SampleFormat::kPcm24}) {
    const std::string path = folder_ / "r.wav";
    {
      auto writer = record(path, format);
      ASSERT_TRUE(writer.ok());
      for (std::size_t block = 1; block <= 5; ++block) {
        ASSERT_TRUE(writer->write(std::vector<float>(2 * 999, 0.25f)).ok());
        EXPECT_EQ(frames_in(path), 999 * block);
        EXPECT_EQ(files(), 1u);
      }
    }  // destroyed without finish(), as if killed
    EXPECT_EQ(frames_in(path), 5u * 999);
  }
}

TEST_F(Recordings, InFlacCanBePlayedButForWhatTheEncoderHoldsBack) {
  const std::string path = folder_ / "r.flac", killed = folder_ / "killed.flac";
  auto writer = record(path, SampleFormat::kPcm24);
  ASSERT_TRUE(writer.ok());
  for (std::size_t block = 1; block <= 100; ++block)
    ASSERT_TRUE(writer->write(std::vector<float>(2 * 960, 0.25f)).ok());
  fs::copy_file(path, killed);
  EXPECT_GE(frames_in(killed) + 2 * 4096, 96000u);
  EXPECT_GT(frames_in(killed), 0u);
  ASSERT_TRUE(writer->finish().ok());
  EXPECT_EQ(frames_in(path), 96000u);
}

TEST_F(Recordings, LeaveAnOlderOneAloneUntilThereIsSound) {
  const std::string path = folder_ / "r.wav";
  std::ofstream(path) << "older";
  {
    const auto writer = record(path, SampleFormat::kFloat32);
    ASSERT_TRUE(writer.ok());
  }
  EXPECT_EQ(fs::file_size(path), 5u);
  EXPECT_EQ(files(), 1u);
}

// A pipe cannot be rewound, so the header leaves the length open.
TEST_F(Recordings, IntoAPipeArriveWhileTheyAreMade) {
  const std::string pipe = folder_ / "pipe", copy = folder_ / "copy.wav";
  ASSERT_EQ(::mkfifo(pipe.c_str(), 0600), 0);
  const int reader = ::open(pipe.c_str(), O_RDONLY | O_NONBLOCK);
  ASSERT_GE(reader, 0);
  auto writer = record(pipe, SampleFormat::kPcm16);
  ASSERT_TRUE(writer.ok()) << writer.error().message;
  ASSERT_TRUE(writer->write(std::vector<float>(2 * 1000, 0.25f)).ok());
  std::string bytes(100000, '\0');
  const ssize_t got = ::read(reader, bytes.data(), bytes.size());
  ASSERT_GT(got, 4000);
  bytes.resize(static_cast<std::size_t>(got));
  EXPECT_EQ(number_at(bytes, 4, 4), 0xffff'ffffu);
  std::ofstream(copy, std::ios::binary) << bytes;
  EXPECT_EQ(frames_in(copy), 1000u);
  ASSERT_TRUE(writer->finish().ok());
  EXPECT_EQ(::read(reader, bytes.data(), bytes.size()), 0) << "nothing follows the samples";
  ::close(reader);
  EXPECT_FALSE(record(folder_ / "no.such/r.wav", SampleFormat::kPcm16).ok());
}

TEST_F(WavFiles, GoThroughLinksAndIntoPipesWithTheirLengthKnown) {
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

TEST_F(WavFiles, ClearAwayWhatKilledProcessesLeft) {
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
