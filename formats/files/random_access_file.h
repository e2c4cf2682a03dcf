// random_access_file.h: an open file, parts of which are looked at when they are needed.
//
// There are two ways to get at the bytes, and both give the same contents and the same errors:
//
//   kRead   pread() copies them into memory of the caller's
//   kMap    the file is mapped, and the bytes are decoded where they are in the page cache, which
//           all processes share that have the file open
//
// A mapping has three dangers. Touching a page that was cut off, or that the disk cannot deliver,
// raises SIGBUS: BusErrorGuard lets the page read as zeros for the moment. Bytes may change at any
// time if somebody overwrites the file in place: whoever decodes them compares the checksum before
// and after, and accepts any bytes in between. And neither tells the reason. So whatever goes wrong
// with mapped bytes, they are read once more with pread(), which either works or says why not. A
// file that cannot be mapped, because its file system or an address limit forbids it, is read.
//
// What each takes: 4 million sources (41 MB, 6107 pages) on two busy cores, the best of six times
// ten runs of `benchmarks --benchmark_filter='first_sound_of|pages_of_file'`:
//
//                                           warm, in the page cache     cold, from the disk
//                                           read         mapped         read         mapped
//   opening                                 0.05 ms      0.06 ms        1.4 ms       1.1 ms
//   first sound (60 ms of waiting at most)  75 ms        66 ms          67 ms        66 ms
//   all pages in order: a second            17 200       16 800         10 800       9 000
//     processor time of each                18.1 us      18.2 us        29.5 us      30.0 us
//   in random order: a second               13 000       14 900         7 700        7 300
//     processor time of each                19.1 us      19.1 us        31.2 us      31.2 us
//   private memory, shared memory           0, 0 MB      0, 38 MB       0, 0 MB      0, 38 MB
//   bytes from the disk                     none         none           38 MB        38 MB
//
// So mapping is no faster where one program plays: the copy it saves (2 %) is what the second
// checksum, the guard and page faults take. What it gains is that players of one level share one
// copy of what they decode from; the kernel takes that memory back when it is needed elsewhere.
//
// Threads: all const functions from any thread at once. The audio thread and the sampler's call
// none.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "common/result.h"
#include "formats/files/bus_error_guard.h"
#include "formats/files/file_access.h"

namespace clamor {

class RandomAccessFile {
 public:
  static Result<RandomAccessFile> open(const std::string& path, FileAccess access);
  RandomAccessFile(RandomAccessFile&& other) noexcept;
  RandomAccessFile& operator=(RandomAccessFile&& other) noexcept;
  RandomAccessFile(const RandomAccessFile&) = delete;
  RandomAccessFile& operator=(const RandomAccessFile&) = delete;
  ~RandomAccessFile();

  std::uint64_t size() const { return version_.bytes; }  // when it was opened
  const FileVersion& version() const { return version_; }
  bool is_mapped() const { return mapped_ != nullptr; }

  // Returns what `decode(bytes, may_change)` does with a range, which the caller has checked
  // against size(); or the Error that the range is not all there (any more). Where the bytes may
  // change, decode() must bear whatever it meets and compare checksums, and is called again with a
  // copy if it returns an Error. Copies are made in `copy`, which is otherwise left alone.
  template <class Decode>
  Result<void> with(std::uint64_t offset, std::uint64_t bytes, std::vector<std::byte>& copy,
                    const Decode& decode) const {
    if (is_mapped() && holds(offset, bytes)) {
      will_need(offset, bytes);  // at once, not page of memory by page of memory
      BusErrorGuard guard({mapped_ + offset, bytes});
      const Result<void> decoded = decode(std::span(mapped_ + offset, bytes), true);
      const std::span<std::byte> zeros = guard.zeros();
      if (!zeros.empty()) map_again(zeros);
      if (zeros.empty() && decoded.ok()) return decoded;
    }
    if (const auto done = read(offset, bytes, copy); !done.ok()) return done;
    return decode(std::span<const std::byte>(copy), false);
  }

  // Lets the kernel fetch the range into the page cache meanwhile. A hint: nothing depends on it.
  void will_need(std::uint64_t offset, std::uint64_t bytes) const;

 private:
  RandomAccessFile() = default;
  bool holds(std::uint64_t offset, std::uint64_t bytes) const {
    return bytes > 0 && offset < size() && bytes <= size() - offset;
  }
  Result<void> read(std::uint64_t offset, std::uint64_t bytes, std::vector<std::byte>& into) const;
  void map();
  void map_again(std::span<std::byte> zeros) const;

  int descriptor_ = -1;
  FileVersion version_;
  std::byte* mapped_ = nullptr;  // all of it, or null
};

}  // namespace clamor
