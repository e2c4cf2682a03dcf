// wav_files.h: a fixture that writes sound files to a temporary folder and reads them back.
#pragma once

#include <cmath>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <numbers>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "formats/audio/audio_file.h"
#include "formats/audio/wav_header.h"
#include "formats/audio/wav_writer.h"

namespace clamor {

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

inline std::uint32_t number_at(const std::string& bytes, std::size_t at, int size) {
  std::uint32_t number = 0;
  for (int i = size; i-- > 0;)
    number = number << 8 | static_cast<unsigned char>(bytes[at + static_cast<std::size_t>(i)]);
  return number;
}

inline std::vector<float> sweep(std::size_t frames) {
  std::vector<float> samples;
  for (std::size_t i = 0; i < frames; ++i)
    samples.push_back(static_cast<float>(0.9 * std::sin(1e-5 * static_cast<double>(i * i))));
  return samples;
}

}  // namespace clamor
