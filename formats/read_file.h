// read_file.h: an open file of which parts are read when they are needed.
//
// Read, not mapped: where a mapped file is cut short by someone else, touching it kills the program
// (SIGBUS); a read only returns less. What was checked is also what is decoded, whatever becomes of
// the file meanwhile. It costs a copy: 2 % of decoding a page.
//
// Threads: all const functions from any thread at once.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "common/result.h"

namespace clamor {

class ReadFile {
 public:
  static Result<ReadFile> open(const std::string& path);
  ReadFile(ReadFile&& other) noexcept;
  ReadFile& operator=(ReadFile&& other) noexcept;
  ReadFile(const ReadFile&) = delete;
  ReadFile& operator=(const ReadFile&) = delete;
  ~ReadFile();

  std::uint64_t size() const { return size_; }  // when it was opened

  // Replaces `into` by so many bytes from an offset; an Error if they are not all there (any more).
  // The caller has checked them against size().
  Result<void> read(std::uint64_t offset, std::uint64_t bytes, std::vector<std::byte>& into) const;

 private:
  ReadFile() = default;

  int descriptor_ = -1;
  std::uint64_t size_ = 0;
};

}  // namespace clamor
