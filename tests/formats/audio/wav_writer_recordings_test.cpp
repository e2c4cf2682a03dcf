#include <fcntl.h>
#include <signal.h>
#include <sndfile.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include "formats/audio/wav_writer.h"
#include "tests/formats/wav_files.h"

namespace clamor {
namespace {

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

TEST_F(Recordings, ArePlayableToTheEndAtAnyTime) {
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

TEST_F(Recordings, InFlacArePlayableExceptForEncoderDelay) {
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

TEST_F(Recordings, KeepAnOlderFileUntilTheFirstWrite) {
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
TEST_F(Recordings, IntoAPipeArriveImmediately) {
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

}  // namespace
}  // namespace clamor
