// random_access_file.h: random access to parts of an open file.
//
// Two access modes give the same contents and the same errors:
//
//   kRead   pread() copies the bytes into a buffer
//   kMap    the file is memory-mapped, and bytes are decoded in place in the page cache, which all
//           processes share that have the file open
//
// A mapping has three dangers. Touching a truncated page, or one that the disk cannot deliver,
// raises SIGBUS: BusErrorGuard substitutes zeros. Bytes may change at any time if another process
// overwrites the file in place: decoders accept any bytes and compare the checksum before and
// after. And neither failure has a reason to report. So after any failure of mapped bytes they are
// read again with pread(), which succeeds or reports why not. A file that cannot be mapped is read.
//
// For a single player mapping is no faster: the copy that it saves (2 %) pays for the second
// checksum, the guard and page faults. Its gain is that players of one level share the page cache,
// which the kernel can reclaim.
//
// An application may also supply the bytes itself, from its own archive or in memory.
//
// Threads: all const functions are thread-safe. They may block, so the audio thread and the
// sampler's thread must not call them.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "common/platform/bus_error_guard.h"
#include "common/platform/system_file.h"
#include "common/result.h"
#include "formats/files/file_access.h"

namespace clamor {

// Bytes that an application supplies. `owner` is released when they are no longer needed.
struct SuppliedBytes {
  // Copies a range within `size` into `into`. Called by several threads at a time.
  using Read = std::function<Result<void>(std::uint64_t offset, std::span<std::byte> into)>;

  std::uint64_t size = 0;
  Read read;                          // not called for bytes in memory
  std::span<const std::byte> memory;  // all of the bytes, which must not change; or empty
  std::shared_ptr<const void> owner;
};

class RandomAccessFile {
 public:
  static Result<RandomAccessFile> open(const std::string& path, FileAccess access);
  explicit RandomAccessFile(SuppliedBytes bytes);

  std::uint64_t size() const { return version_.bytes; }  // at the time of opening
  const FileVersion& version() const { return version_; }
  bool is_mapped() const { return mapped_ != nullptr; }

  // Returns the result of `decode(bytes, may_change)` for a range that the caller has checked
  // against size(), or an Error if the range cannot be read (any more). If `may_change` is set,
  // decode() must tolerate any bytes and compare checksums; it is called again with a copy after an
  // Error. Copies are made in `copy`, which is otherwise left alone.
  template <class Decode>
  Result<void> with(std::uint64_t offset, std::uint64_t bytes, std::vector<std::byte>& copy,
                    const Decode& decode) const {
    if (!supplied_.memory.empty() && holds(offset, bytes))
      return decode(supplied_.memory.subspan(static_cast<std::size_t>(offset),
                                             static_cast<std::size_t>(bytes)),
                    false);
    if (is_mapped() && holds(offset, bytes)) {
      will_need(offset, bytes);  // one request instead of one per memory page
      const std::span mapped(mapped_.get() + offset, static_cast<std::size_t>(bytes));
      BusErrorGuard guard(mapped);
      const Result<void> decoded = decode(mapped, true);
      const std::span<std::byte> zeros = guard.zeros();
      if (!zeros.empty()) file_.map_again(mapped_, zeros);
      if (zeros.empty() && decoded.ok()) return decoded;
    }
    if (const auto done = read(offset, bytes, copy); !done.ok()) return done;
    return decode(std::span<const std::byte>(copy), false);
  }

  // Hints the kernel to prefetch the range into the page cache.
  void will_need(std::uint64_t offset, std::uint64_t bytes) const;

 private:
  RandomAccessFile() = default;
  bool holds(std::uint64_t offset, std::uint64_t bytes) const {
    return bytes > 0 && offset < size() && bytes <= size() - offset;
  }
  Result<void> read(std::uint64_t offset, std::uint64_t bytes, std::vector<std::byte>& into) const;

  SystemFile file_;
  FileVersion version_;
  FileMapping mapped_;      // the whole file, or null
  SuppliedBytes supplied_;  // instead of a file
};

}  // namespace clamor
