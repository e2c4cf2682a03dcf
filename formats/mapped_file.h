// mapped_file.h: a file's bytes in memory, read only when touched.
#pragma once

#include <cstddef>
#include <span>
#include <string>

#include "common/result.h"

namespace clamor {

class MappedFile {
 public:
  static Result<MappedFile> open(const std::string& path);
  MappedFile(MappedFile&& other) noexcept;
  MappedFile& operator=(MappedFile&& other) noexcept;
  MappedFile(const MappedFile&) = delete;
  MappedFile& operator=(const MappedFile&) = delete;
  ~MappedFile();

  // Starts on a page of memory. Empty for an empty file.
  std::span<const std::byte> bytes() const { return {start_, size_}; }

 private:
  MappedFile() = default;

  const std::byte* start_ = nullptr;
  std::size_t size_ = 0;
};

}  // namespace clamor
