// scratch_file.h: a temporary file without a name, for what does not fit into memory.
//
// It is created beside the output, where there should be space, and unlinked at once: its space is
// freed when the object or the process ends.
//
// Threads: one at a time; read() also concurrently.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>

#include "common/platform/system_file.h"
#include "common/result.h"

namespace clamor {

class ScratchFile {
 public:
  // Creates the file beside `beside` with the first bytes.
  explicit ScratchFile(std::string beside) : beside_(std::move(beside)) {}
  ScratchFile(ScratchFile&& other) noexcept;
  ScratchFile& operator=(ScratchFile&& other) noexcept;
  ScratchFile(const ScratchFile&) = delete;
  ScratchFile& operator=(const ScratchFile&) = delete;

  Result<void> append(std::span<const std::byte> bytes);

  // Reads existing bytes.
  Result<void> read(std::uint64_t offset, std::span<std::byte> bytes) const;

  // The first `bytes` bytes as memory, at first zero, which the system moves to the disk and back;
  // valid as long as the object. Not together with append().
  Result<std::span<std::byte>> map(std::uint64_t bytes);

  const std::string& beside() const { return beside_; }
  std::uint64_t bytes() const { return bytes_; }

 private:
  Result<void> open();
  Error failed(const char* doing) const;

  std::string beside_;
  std::uint64_t bytes_ = 0;
  SystemFile file_;
  FileMapping mapped_;
};

}  // namespace clamor
