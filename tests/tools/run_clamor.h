// run_clamor.h: runs the program inside the test and returns its output as strings.
#pragma once

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <sstream>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <unistd.h>

#include "tests/build_paths.h"
#include "tools/commands/commands.h"

namespace clamor::testing {

struct Outcome {
  int code = 0;
  std::string out, err;
};

inline Outcome clamor(const std::vector<std::string>& arguments) {
  std::ostringstream out, err;
  const int code = run_clamor(arguments, out, err);
  return {code, out.str(), err.str()};
}

// A temporary folder, removed with everything in it.
class Folder {
 public:
  Folder() {
    static int count = 0;
    path_ = std::filesystem::temp_directory_path() /
            ("clamor_test_" + std::to_string(::getpid()) + "_" + std::to_string(count++));
    std::filesystem::create_directories(path_);
  }
  ~Folder() {
    std::error_code ignored;
    std::filesystem::remove_all(path_, ignored);
  }

  std::string path() const { return path_.string(); }
  std::string operator/(const std::string& name) const { return (path_ / name).string(); }

  std::string write(const std::string& name, const std::string& content) const {
    std::ofstream(path_ / name, std::ios::binary) << content;
    return *this / name;
  }

  // Sorted names of the files in it, to check that nothing was left behind.
  std::vector<std::string> names() const {
    std::vector<std::string> names;
    for (const auto& entry : std::filesystem::directory_iterator(path_))
      names.push_back(entry.path().filename().string());
    std::sort(names.begin(), names.end());
    return names;
  }

 private:
  std::filesystem::path path_;
};

// Returns all bytes of a file; "" if there is none.
inline std::string read(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
}

// A level without meshes: a free field.
inline constexpr const char* kEmptyLevel =
    R"({"asset":{"version":"2.0"},"scene":0,"scenes":[{"nodes":[]}]})";

inline std::string violin_room() {
  return std::string(testing::kSourceDir) + "/assets/levels/violin_room.glb";
}

}  // namespace clamor::testing
