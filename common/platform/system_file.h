// system_file.h: files of the operating system, by path and open.
//
// What fails returns false or nothing and leaves its reason in errno (system_reason.h). Calls that
// signals interrupt are repeated.
//
// Threads: const functions are as safe as the system's calls: read_at() and write_at() may run at
// once.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <utility>

namespace clamor {

enum class FileType : std::uint8_t { kRegular, kFolder, kPipe, kCharacterDevice, kSocket, kOther };

struct FileVersion {
  std::uint64_t device = 0, inode = 0, bytes = 0;
  std::int64_t modified_ns = 0;

  bool operator==(const FileVersion&) const = default;
  bool is_same_file(const FileVersion& other) const {
    return device == other.device && inode == other.inode;
  }
};

struct FileStatus {
  FileType type = FileType::kOther;
  FileVersion version;
};

// What lies at the end of the links that `path` names.
std::optional<FileStatus> file_status(const std::string& path);

// Current version of the file at `path`; none if it is no regular file.
std::optional<FileVersion> file_version(const std::string& path);

// Whether a write failed because the disk, a quota or a limit of files has no more room.
bool is_disk_full(int code);

bool may_write(const std::string& path);
bool may_write_in_folder(const std::string& path);
void remove_file(const std::string& path);

// Gives a file another name, whose previous file it replaces at once.
bool replace_file(const std::string& from, const std::string& to);

// Makes new names in a folder survive a power cut, where the file system supports it. Failures are
// ignored.
void sync_folder(const std::string& folder);

// The standard descriptors 0 to 2, and those that a path in /proc names.
bool is_open_to_write(int descriptor);

// Memory whose bytes are those of a file.
struct FileUnmapper {
  std::size_t bytes = 0;
  void operator()(std::byte* memory) const;
};
using FileMapping = std::unique_ptr<std::byte, FileUnmapper>;

class SystemFile {
 public:
  enum class Mode : std::uint8_t {
    kRead,    // opening a pipe does not wait for its writer
    kCreate,  // to write; there must be no file of that name
    kUpdate,  // to read and write, also a new file
    kStream   // to write to a pipe or device
  };

  SystemFile() = default;
  SystemFile(const std::string& path, Mode mode);
  // Another descriptor of the same open file.
  static SystemFile duplicate(int descriptor);
  // A new file without a name, to read and write. The pattern ends with XXXXXX.
  static SystemFile unnamed(std::string pattern);

  SystemFile(SystemFile&& other) noexcept : descriptor_(std::exchange(other.descriptor_, -1)) {}
  SystemFile& operator=(SystemFile&& other) noexcept {
    std::swap(descriptor_, other.descriptor_);
    return *this;
  }
  SystemFile(const SystemFile&) = delete;
  SystemFile& operator=(const SystemFile&) = delete;
  ~SystemFile() { close(); }
  void close();

  bool is_open() const { return descriptor_ >= 0; }
  std::optional<FileStatus> status() const;

  // Returns how many bytes were read, which are fewer only at the end of the file.
  std::optional<std::size_t> read_at(std::uint64_t offset, std::span<std::byte> into) const;
  // Write all bytes, also to a full disk's error.
  bool write(std::span<const std::byte> bytes) const;
  bool write_at(std::uint64_t offset, std::span<const std::byte> bytes) const;

  bool truncate(std::uint64_t bytes) const;
  // Makes the file that long, with space on the disk for all of it.
  bool allocate(std::uint64_t bytes) const;

  // Make what was written survive a power cut; sync_bytes() leaves out the time of the change.
  bool sync() const;
  bool sync_bytes() const;

  // Locks the whole file for this SystemFile alone. errno is EAGAIN or EACCES if another has it.
  bool lock() const;
  // Whether another has locked the file, on any machine that shares the file system.
  bool is_locked() const;

  // Null on failure. The file is read at random: the system prefetches nothing unasked.
  FileMapping map_to_read(std::size_t bytes) const;
  FileMapping map_to_write(std::size_t bytes) const;
  // Maps pages of map_to_read() again after a BusErrorGuard replaced them. If that fails, the zeros
  // stay.
  void map_again(const FileMapping& mapping, std::span<std::byte> pages) const;

  // Hints that bytes of the file, or those pages of its mapping, are read soon.
  void will_need(std::uint64_t offset, std::uint64_t bytes) const;
  static void will_need(std::span<std::byte> pages);
  // Takes whole pages of map_to_write() out of this process's memory; the file keeps their bytes.
  static void release(std::span<std::byte> bytes);

 private:
  int descriptor_ = -1;
};

}  // namespace clamor
