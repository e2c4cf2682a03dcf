// journal_file.h: an append-only file of records that survives crashes of its writer.
//
// The file starts with 16 bytes ("CLAMORTJ" and the version). Each record has a header of 40 bytes
// and one zstd frame, both verified by xxHash3 when read. The file is synced once per second, so a
// power cut loses at most one second; the name of a new file is synced at once. A record consists
// of a count and bytes; trace_journal.h defines their meaning.
//
// Threads: one at a time. Memory: one record.
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "common/platform/system_file.h"
#include "common/result.h"

namespace clamor {

class JournalFile {
 public:
  struct Record {
    std::uint32_t count = 0;
    std::span<const std::byte> bytes;  // valid until the next read()
  };

  JournalFile() = default;
  ~JournalFile();
  JournalFile(const JournalFile&) = delete;
  JournalFile& operator=(const JournalFile&) = delete;

  // Creates or opens the file and locks it against other processes. Fails on files that are no
  // journal.
  Result<void> open(const std::string& path);

  // Opens an existing file without creating, truncating or locking it.
  Result<void> open_to_read(const std::string& path);

  // Whether a process, on any machine that shares the file system, has the file open to write. For
  // files that this process has only open to read.
  bool is_being_written() const;

  const std::string& path() const { return path_; }
  std::uint64_t bytes() const { return bytes_; }

  // Bytes at the end that belong to no complete record and were left out by truncate_at().
  std::uint64_t cut_bytes() const { return cut_bytes_; }

  // Calls visit(offset) for each complete record, in their order; returns where the last one ends.
  template <class Visit>
  std::uint64_t for_each(const Visit& visit) const {
    std::uint64_t offset = beginning().size();
    while (const auto end = after(offset)) {
      visit(offset);
      offset = *end;
    }
    return offset;
  }

  // What a file starts with, before its first record.
  static std::vector<std::byte> beginning();

  // The number of runs of the record at `offset`, without reading its bytes; 0 if it has none.
  std::uint32_t count_at(std::uint64_t offset) const;

  // The record at `offset`, or nothing if it is damaged.
  std::optional<Record> read(std::uint64_t offset);

  // Frees the memory of the last record that was read.
  void release();

  // The header and the frame of the record at `offset` as they are in the file, or nothing if it is
  // damaged.
  std::optional<std::vector<std::byte>> stored(std::uint64_t offset) const;

  // A record as it is in the file.
  static std::vector<std::byte> record_of(std::uint32_t count, std::span<const std::byte> bytes);

  // Appends a record and returns its offset. On failure (a full disk) the file keeps its old
  // contents.
  Result<std::uint64_t> append(std::uint32_t count, std::span<const std::byte> bytes);

  // Removes an incomplete record at `offset` and everything after it.
  Result<void> truncate_at(std::uint64_t offset);

  // Forces all appended records to disk. The journal does so once per second and when closed, but
  // only this call reports errors.
  Result<void> sync();

  // Rewrites the file with only these records (ascending offsets) if that halves its size, or in
  // any case. No other call may follow, because the open file is then the replaced one.
  Result<void> keep_only(std::span<const std::uint64_t> records, bool in_any_case);

 private:
  using Clock = std::chrono::steady_clock;

  // The offset after the record at `offset`; nothing if that is incomplete.
  std::optional<std::uint64_t> after(std::uint64_t offset) const;
  bool read_at(std::uint64_t offset, std::span<std::byte> out) const;
  bool sync_file();
  Error unwritten() const;

  std::string path_;
  SystemFile file_;
  bool only_read_ = false;
  std::uint64_t bytes_ = 0, synced_bytes_ = 0, cut_bytes_ = 0;
  Clock::time_point last_sync_ = Clock::now();
  std::uint64_t read_record_ = 0;  // offset of the record in `unpacked_`; 0: none
  std::uint32_t read_count_ = 0;
  std::vector<std::byte> unpacked_;
};

}  // namespace clamor
