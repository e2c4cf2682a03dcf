// journal_file.h: a file of records that only grows, and survives whatever stops its writer.
//
// 16 bytes "CLAMORTJ", version; then records: a header of 40 bytes, then one zstd frame. Each is
// checked by xxHash3 when it is used. It is synced once a second: a power cut loses no more than
// that, and the new file's name not. What a record says is its user's (trace_journal.h); here it
// has a count and bytes.
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

#include "common/result.h"

namespace clamor {

class JournalFile {
 public:
  struct Record {
    std::uint32_t count = 0;
    std::span<const std::byte> bytes;  // valid until another is read
  };

  JournalFile() = default;
  ~JournalFile();
  JournalFile(const JournalFile&) = delete;
  JournalFile& operator=(const JournalFile&) = delete;

  // Makes the file or opens what is there, for this process alone; refuses what is no journal.
  Result<void> open(const std::string& path);

  // Nothing is made, cut off or locked.
  Result<void> open_to_read(const std::string& path);

  const std::string& path() const { return path_; }
  std::uint64_t bytes() const { return bytes_; }

  // Where the first record begins, and the one after the record that begins there, were it there.
  static std::uint64_t first();
  std::optional<std::uint64_t> after(std::uint64_t offset) const;

  // The record that begins there; none if it is damaged.
  std::optional<Record> read(std::uint64_t offset);

  // Adds a record and says where it begins. On failure (a full disk) the file is what it was.
  Result<std::uint64_t> append(std::uint32_t count, std::span<const std::byte> bytes);

  // Nothing from there on counts: a crash left it incomplete.
  Result<void> truncate_at(std::uint64_t offset);

  // What was added is on the disk: done at every second anyway, and when the file is closed, but
  // only this says whether it worked.
  Result<void> sync();

  // Leaves only these records, ascending, if that is less than half of the file. To be done last:
  // the file that is open is then another.
  Result<void> keep_only(std::span<const std::uint64_t> records);

 private:
  using Clock = std::chrono::steady_clock;

  bool read_at(std::uint64_t offset, std::span<std::byte> out) const;
  bool write_at(std::uint64_t offset, std::span<const std::byte> data) const;
  bool cut(std::uint64_t length) const;
  bool sync_file();
  Error unwritten() const;

  std::string path_;
  int descriptor_ = -1;
  bool only_read_ = false;
  std::uint64_t bytes_ = 0, synced_bytes_ = 0;
  Clock::time_point last_sync_ = Clock::now();
  std::uint64_t read_record_ = 0;  // what `unpacked_` holds; 0: nothing
  std::uint32_t read_count_ = 0;
  std::vector<std::byte> unpacked_;
};

}  // namespace clamor
