#include "formats/audio/wav_header.h"

#include <fcntl.h>
#include <signal.h>
#include <sndfile.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include "tests/formats/wav_files.h"

namespace clamor {
namespace {

// Non-PCM formats require an extension size, even if 0; sox warns if it is missing.
TEST_F(WavFiles, HaveACompleteFormatChunk) {
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
TEST_F(WavFiles, HaveConsistentChunkSizes) {
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
TEST_F(WavFiles, BecomeRf64OnlyAbove4Gigabytes) {
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

}  // namespace
}  // namespace clamor
