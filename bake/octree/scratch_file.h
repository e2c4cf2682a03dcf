// scratch_file.h: a temporary file without a name, as memory for what would exceed the memory.
//
// It is created beside the output, where there should be space, and unlinked at once: its space is
// freed when the object or the process ends.
//
// Threads: one at a time.
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
  // Creates the file beside `beside` when it is first mapped.
  explicit ScratchFile(std::string beside = {}) : beside_(std::move(beside)) {}

  // The first `bytes` bytes as memory, at first zero, which the system moves to the disk and back;
  // valid until the next call and as long as the object.
  Result<std::span<std::byte>> map(std::uint64_t bytes);

  const std::string& beside() const { return beside_; }

 private:
  Error failed(const char* doing) const;

  std::string beside_;
  SystemFile file_;
  FileMapping mapped_;
};

}  // namespace clamor
