// temporary_file.h: temporary files of a test, and bakes written to and opened from them.
#pragma once

#include <filesystem>
#include <fstream>
#include <iterator>
#include <memory>
#include <string>
#include <system_error>

#include <gtest/gtest.h>
#include <unistd.h>

#include "formats/bake_file/bake_contents.h"
#include "formats/bake_file/bake_file.h"
#include "formats/bake_file/bake_writer.h"

namespace clamor::testing {

// A unique path; the file is removed at the end.
class TemporaryFile {
 public:
  explicit TemporaryFile(const std::string& ending)
      : path_((std::filesystem::temp_directory_path() /
               ("clamor_" + std::to_string(::getpid()) + "_" + std::to_string(next_++) + ending))
                  .string()) {}
  TemporaryFile(const std::string& ending, const std::string& bytes) : TemporaryFile(ending) {
    std::ofstream(path_, std::ios::binary) << bytes;
  }
  ~TemporaryFile() {
    std::error_code ignored;
    std::filesystem::remove(path_, ignored);
  }
  TemporaryFile(const TemporaryFile&) = delete;
  TemporaryFile& operator=(const TemporaryFile&) = delete;

  const std::string& path() const { return path_; }
  std::string bytes() const {
    std::ifstream file(path_, std::ios::binary);
    return {std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
  }

 private:
  static inline int next_ = 0;
  const std::string path_;
};

inline void write(const BakeContents& contents, const TemporaryFile& file, int threads = 1) {
  const auto done = write_bake(file.path(), contents, threads);
  EXPECT_TRUE(done.ok()) << (done.ok() ? "" : done.error().message);
}

inline std::shared_ptr<const BakeFile> opened(const TemporaryFile& file) {
  auto bake = BakeFile::open(file.path());
  EXPECT_TRUE(bake.ok()) << (bake.ok() ? "" : bake.error().message);
  return std::make_shared<const BakeFile>(std::move(*bake));
}

// Returns an open bake file whose path is already removed.
inline std::shared_ptr<const BakeFile> as_file(const BakeContents& contents) {
  const TemporaryFile file(".clamor");
  write(contents, file);
  return opened(file);
}

}  // namespace clamor::testing
