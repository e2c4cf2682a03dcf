// fuzz_target.h: helpers of the fuzz targets.
//
// A target takes arbitrary bytes and must return without crash, hang or excessive memory. The
// preset `fuzz` links each target with libFuzzer, AddressSanitizer and UndefinedBehaviorSanitizer:
//
//   cmake --preset fuzz && cmake --build --preset fuzz
//   build/fuzz/tests/fuzz_sidecar tests/fuzz/corpus/sidecar -max_len=4096 -malloc_limit_mb=256
//
// The preset asan replays the corpus, which contains inputs that reached new code or once failed.
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <span>
#include <string>
#include <string_view>

#include <unistd.h>

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size);

namespace clamor::fuzz {

inline std::string_view text_of(const std::uint8_t* data, std::size_t size) {
  return {reinterpret_cast<const char*>(data), size};
}

// Writes the bytes to a temporary file of this process, which the next call replaces.
inline std::string file_with(std::string_view bytes, const std::string& suffix) {
  static const std::string folder = [] {
    std::string name = (std::filesystem::temp_directory_path() / "clamor_fuzz_XXXXXX").string();
    if (::mkdtemp(name.data()) == nullptr) std::abort();
    return name;
  }();
  static const bool swept = [] {
    std::atexit([] {
      std::error_code ignored;
      std::filesystem::remove_all(folder, ignored);
    });
    return true;
  }();
  (void)swept;
  const std::string path = folder + "/input" + suffix;
  std::ofstream(path, std::ios::binary) << bytes;
  return path;
}

}  // namespace clamor::fuzz
