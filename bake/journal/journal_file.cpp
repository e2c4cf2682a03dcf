#include "bake/journal/journal_file.h"

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <utility>

#include "common/system_reason.h"
#include "formats/bake_file/bake_layout.h"
#include "formats/files/atomic_file.h"

namespace clamor {

namespace {

constexpr std::array<char, 8> kJournalMagic = {'C', 'L', 'A', 'M', 'O', 'R', 'T', 'J'};
constexpr std::uint32_t kJournalVersion = 4;
constexpr std::uint32_t kRecordMagic = 0x6e757254;  // "Trun"
constexpr std::uint64_t kMaxRecordBytes = std::uint64_t{1} << 30;
// A sync takes 0.4 to 20 ms, depending on the disk, and there are some 40 batches per second. One
// sync per second costs at most 2 %; one per batch costs 5 to 67 %.
constexpr auto kSyncEvery = std::chrono::seconds(1);
constexpr std::uint64_t kMaxRatio = 4000;  // maximum compression ratio of our zstd frames

struct FileHeader {
  std::array<char, 8> magic = kJournalMagic;
  std::uint32_t version = kJournalVersion, unused = 0;
};
static_assert(sizeof(FileHeader) == 16);

struct RecordHeader {
  std::uint32_t magic = kRecordMagic, count = 0;
  std::uint64_t packed_bytes = 0, unpacked_bytes = 0;
  std::uint64_t frame_hash = 0;
  std::uint64_t header_hash = 0;  // of the preceding 32 bytes
};
static_assert(sizeof(RecordHeader) == 40);

template <class T>
std::span<const std::byte> bytes_of(const T& value) {
  return std::as_bytes(std::span(&value, 1));
}

// Parses a header; nothing if its hash or one of its values is invalid.
std::optional<RecordHeader> checked(std::span<const std::byte, sizeof(RecordHeader)> raw,
                                    std::uint64_t bytes_left) {
  RecordHeader header;
  std::memcpy(&header, raw.data(), raw.size());
  if (header.magic != kRecordMagic || header.header_hash != hash_of(raw.first(raw.size() - 8)) ||
      header.packed_bytes > bytes_left || header.unpacked_bytes > kMaxRecordBytes ||
      header.unpacked_bytes > kMaxRatio * header.packed_bytes)
    return std::nullopt;
  return header;
}

std::string reason() { return system_reason(errno); }

}  // namespace

JournalFile::~JournalFile() {
  if (file_.is_open() && !only_read_ && synced_bytes_ != bytes_) sync_file();
}

Result<void> JournalFile::open(const std::string& path) {
  path_ = path;
  file_ = SystemFile(path, SystemFile::Mode::kUpdate);
  if (!file_.is_open())
    return Error(path + ": the journal cannot be opened (" + reason() +
                 "); make its folder writable, or use --no-journal");
  const auto status = file_.status();
  if (!status || status->type != FileType::kRegular)
    return Error(path + ": is not a regular file, so it cannot be a journal");
  if (!file_.lock()) {
    if (errno != EAGAIN && errno != EACCES)
      return Error(path + ": the journal cannot be locked (" + reason() +
                   "); choose a folder whose file system has locks, or use --no-journal");
    return Error(path +
                 ": another bake is writing this journal; wait for it to end, or choose "
                 "another output");
  }
  bytes_ = status->version.bytes;

  const FileHeader header;
  const auto wanted = bytes_of(header);
  std::array<std::byte, sizeof header> raw;
  const auto present = std::span(raw).first(std::min<std::uint64_t>(bytes_, raw.size()));
  if (!read_at(0, present)) return Error(path + ": cannot be read (" + reason() + ")");
  if (!std::ranges::equal(present, wanted.first(present.size()))) {
    FileHeader found;
    std::memcpy(&found, raw.data(), present.size());
    if (present.size() == raw.size() && found.magic == kJournalMagic)
      return Error(path + ": is the journal of another version of clamor (journal version " +
                   std::to_string(found.version) + ", this one writes " +
                   std::to_string(kJournalVersion) +
                   "), and is left alone; remove it, or choose another output");
    return Error(path +
                 ": is no journal of a bake, and is left alone; remove it, or choose "
                 "another output");
  }
  // A crash may have left a new file empty or its header incomplete.
  if (bytes_ < sizeof header) {
    if (!file_.truncate(0) || !file_.write_at(0, bytes_of(header)) || !sync_file())
      return Error(path + ": cannot be written (" + reason() +
                   "); free some space, or use --no-journal");
    sync_folder_of(path);
    bytes_ = sizeof header;
  }
  synced_bytes_ = bytes_;
  return {};
}

Result<void> JournalFile::open_to_read(const std::string& path) {
  path_ = path;
  only_read_ = true;
  file_ = SystemFile(path, SystemFile::Mode::kRead);
  const auto status = file_.is_open() ? file_.status() : std::nullopt;
  if (!status) return Error(path + ": cannot be read (" + reason() + ")");
  if (status->type != FileType::kRegular) return Error(path + ": is not a regular file");
  bytes_ = status->version.bytes;
  FileHeader header;
  std::array<std::byte, sizeof header> raw;
  const bool whole = bytes_ >= sizeof header && read_at(0, raw);
  if (whole) std::memcpy(&header, raw.data(), sizeof header);
  if (!whole || header.magic != kJournalMagic)
    return Error(path + ": holds no traced photons; shards are made with clamor bake --shard I/N");
  if (header.version != kJournalVersion)
    return Error(path + ": was written by another version of clamor (journal version " +
                 std::to_string(header.version) + ", this one writes " +
                 std::to_string(kJournalVersion) + "); trace it again");
  return {};
}

bool JournalFile::is_being_written() const { return file_.is_locked(); }

bool JournalFile::read_at(std::uint64_t offset, std::span<std::byte> out) const {
  return file_.read_at(offset, out) == out.size();
}

// Makes all previous writes survive a power cut.
bool JournalFile::sync_file() {
  if (!file_.sync_bytes()) return false;
  synced_bytes_ = bytes_;
  last_sync_ = Clock::now();
  return true;
}

// Error message for errno; call right after a failed write or sync.
Error JournalFile::unwritten() const {
  return Error(path_ + ": the journal cannot be written (" + reason() +
               "); what was traced before is kept. Free some space and run the same command "
               "again, or use --no-journal");
}

Result<void> JournalFile::sync() {
  return sync_file() ? Result<void>() : Result<void>(unwritten());
}

std::vector<std::byte> JournalFile::beginning() {
  const FileHeader header;
  const auto bytes = bytes_of(header);
  return {bytes.begin(), bytes.end()};
}

std::uint32_t JournalFile::count_at(std::uint64_t offset) const {
  std::array<std::byte, sizeof(RecordHeader)> raw;
  if (offset + raw.size() > bytes_ || !read_at(offset, raw)) return 0;
  const auto header = checked(raw, bytes_ - offset - raw.size());
  return header ? header->count : 0;
}

std::optional<std::uint64_t> JournalFile::after(std::uint64_t offset) const {
  std::array<std::byte, sizeof(RecordHeader)> raw;
  if (offset + raw.size() > bytes_ || !read_at(offset, raw)) return std::nullopt;
  const auto header = checked(raw, bytes_ - offset - raw.size());
  if (!header) return std::nullopt;
  return offset + raw.size() + header->packed_bytes;
}

std::optional<std::vector<std::byte>> JournalFile::stored(std::uint64_t offset) const {
  const auto end = after(offset);
  if (!end) return std::nullopt;
  std::vector<std::byte> whole(*end - offset);
  if (!read_at(offset, whole)) return std::nullopt;
  RecordHeader header;
  std::memcpy(&header, whole.data(), sizeof header);
  if (hash_of(std::span(whole).subspan(sizeof header)) != header.frame_hash) return std::nullopt;
  return whole;
}

std::optional<JournalFile::Record> JournalFile::read(std::uint64_t offset) {
  if (offset == read_record_) return Record{read_count_, unpacked_};
  read_record_ = 0;
  const auto whole = stored(offset);
  if (!whole) return std::nullopt;
  RecordHeader header;
  std::memcpy(&header, whole->data(), sizeof header);
  auto bytes = unpacked(std::span(*whole).subspan(sizeof header), header.unpacked_bytes);
  if (!bytes.ok()) return std::nullopt;
  unpacked_ = std::move(*bytes);
  read_count_ = header.count;
  read_record_ = offset;
  return Record{read_count_, unpacked_};
}

void JournalFile::release() {
  read_record_ = 0;
  unpacked_ = std::vector<std::byte>();  // assigning {} would keep the capacity
}

std::vector<std::byte> JournalFile::record_of(std::uint32_t count,
                                              std::span<const std::byte> bytes) {
  const std::vector<std::byte> frame = packed(bytes);
  RecordHeader header;
  header.count = count;
  header.packed_bytes = frame.size();
  header.unpacked_bytes = bytes.size();
  header.frame_hash = hash_of(frame);
  header.header_hash = hash_of(bytes_of(header).first(sizeof header - 8));
  std::vector<std::byte> record(sizeof header + frame.size());
  std::memcpy(record.data(), &header, sizeof header);
  std::memcpy(record.data() + sizeof header, frame.data(), frame.size());
  return record;
}

Result<std::uint64_t> JournalFile::append(std::uint32_t count, std::span<const std::byte> bytes) {
  const std::vector<std::byte> record = record_of(count, bytes);
  const auto sync_now_and_then = [&] {
    return Clock::now() - last_sync_ < kSyncEvery || sync_file();
  };
  if (!file_.write_at(bytes_, record) || !sync_now_and_then()) {
    const Error error = unwritten();
    (void)file_.truncate(bytes_);  // if this fails too, the next open() truncates the record
    return error;
  }
  return std::exchange(bytes_, bytes_ + record.size());
}

Result<void> JournalFile::truncate_at(std::uint64_t offset) {
  if (!only_read_ && offset < bytes_ && !file_.truncate(offset))
    return Error(path_ + ": cannot be cut to its last complete record (" + reason() + ")");
  cut_bytes_ = bytes_ - offset;
  bytes_ = offset;
  synced_bytes_ = bytes_;
  return {};
}

Result<void> JournalFile::keep_only(std::span<const std::uint64_t> records, bool in_any_case) {
  std::uint64_t kept = sizeof(FileHeader);
  for (const std::uint64_t record : records)
    if (const auto end = after(record)) kept += *end - record;
  if (!in_any_case && 2 * kept >= bytes_) return {};

  auto file = AtomicFile::create(path_);
  if (!file.ok()) return file.error();
  if (auto written = file->write(beginning()); !written.ok()) return written.error();
  for (const std::uint64_t record : records) {
    const auto end = after(record);
    if (!end) continue;
    std::vector<std::byte> whole(*end - record);
    if (!read_at(record, whole)) continue;
    if (auto written = file->write(whole); !written.ok()) return written.error();
  }
  if (auto done = file->commit(); !done.ok()) return done.error();
  bytes_ = kept;
  return {};
}

}  // namespace clamor
