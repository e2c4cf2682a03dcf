// file_faults.h: what can happen to a bake file while it is played, and the bakes for such tests.
#pragma once

#include <filesystem>
#include <fstream>
#include <functional>
#include <span>
#include <sstream>
#include <string>
#include <vector>

#include "common/random.h"
#include "formats/bake_file/bake_writer.h"
#include "tests/baked_room.h"
#include "tests/tools/run_clamor.h"

namespace clamor::testing {

// A test with FaultInjection fails the reads of this thread only, because a sound that fails is
// silent.
inline constexpr const char* kPageLoader = "page loader";

// A room with noise, so that loudness does not depend on interference.
inline const BakeContents& room() {
  static const BakeContents contents = [] {
    BakeContents made = baked_contents(4000);
    for (std::uint32_t s = 0; s < made.signals.size(); ++s) {
      made.signals[s].loop = true;
      made.signals[s].samples.resize(24000);
      for (std::uint32_t i = 0; i < 24000; ++i)
        made.signals[s].samples[i] =
            static_cast<float>(0.02 * (unit(philox(7, {i, s, 0, 0})[0]) - 0.5));
    }
    return made;
  }();
  return contents;
}

// Written in advance, so that the replacement is fast.
inline const BakeContents& other_room() {
  static const BakeContents contents = baked_contents(100);
  return contents;
}

inline const std::string& other_bytes() {
  static const std::string bytes = [] {
    const Folder folder;
    EXPECT_TRUE(write_bake(folder / "other.clamor", other_room(), 1).ok());
    return read(folder / "other.clamor");
  }();
  return bytes;
}

// A change of a file while it is read.
struct FileFault {
  const char* what;
  std::function<void(const std::string& path)> strike;
  bool is_noticed;
};

inline std::vector<FileFault> file_faults() {
  other_bytes();
  const auto size = [](const std::string& path) { return std::filesystem::file_size(path); };
  return {
      {"cut to an eighth", [=](auto& path) { std::filesystem::resize_file(path, size(path) / 8); },
       true},
      {"cut to nothing", [](auto& path) { std::filesystem::resize_file(path, 0); }, true},
      {"overwritten with garbage",
       [=](auto& path) {
         std::fstream file(path, std::ios::binary | std::ios::in | std::ios::out);
         file << std::string(size(path), '\xa5');
       },
       true},
      {"overwritten in place by another bake",
       [](auto& path) { std::ofstream(path, std::ios::binary | std::ios::trunc) << other_bytes(); },
       true},
      // After these, the reader still has the file that it opened.
      {"replaced by another bake",
       [](auto& path) { ASSERT_TRUE(write_bake(path, other_room(), 1).ok()); }, false},
      {"deleted", [](auto& path) { std::filesystem::remove(path); }, false}};
}

inline double energy_of(std::span<const float> samples) {
  double sum = 0;
  for (const float sample : samples) sum += static_cast<double>(sample) * sample;
  return sum;
}

// Number of lines that contain `part`.
inline long lines_with(const std::string& text, const std::string& part) {
  std::istringstream lines(text);
  long count = 0;
  for (std::string line; std::getline(lines, line);) count += line.find(part) != std::string::npos;
  return count;
}

}  // namespace clamor::testing
