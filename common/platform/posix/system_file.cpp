// system_file.cpp: files by POSIX, with locks of open files as Linux has them.
#include "common/platform/system_file.h"

#include <cerrno>

#include <fcntl.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

#include "common/platform/posix/retry_on_eintr.h"

namespace clamor {

namespace {

FileStatus status_of(const struct stat& status) {
  const auto type = [&] {
    switch (status.st_mode & S_IFMT) {
      case S_IFREG:
        return FileType::kRegular;
      case S_IFDIR:
        return FileType::kFolder;
      case S_IFIFO:
        return FileType::kPipe;
      case S_IFCHR:
        return FileType::kCharacterDevice;
      case S_IFSOCK:
        return FileType::kSocket;
      default:
        return FileType::kOther;
    }
  };
  return {
      type(),
      {status.st_dev, status.st_ino, static_cast<std::uint64_t>(status.st_size),
       static_cast<std::int64_t>(status.st_mtim.tv_sec) * 1'000'000'000 + status.st_mtim.tv_nsec}};
}

int flags_of(SystemFile::Mode mode) {
  switch (mode) {
    case SystemFile::Mode::kRead:
      return O_RDONLY | O_NONBLOCK;
    case SystemFile::Mode::kCreate:
      return O_WRONLY | O_CREAT | O_EXCL;
    case SystemFile::Mode::kUpdate:
      return O_RDWR | O_CREAT;
    case SystemFile::Mode::kStream:
      break;
  }
  return O_WRONLY | O_NOCTTY;
}

// A lock of the whole file that belongs to the open file, as flock() makes them; other than with
// flock(), others can ask for it without taking it, also on a shared file system.
struct flock lock_of_file() {
  struct flock lock {};
  lock.l_type = F_WRLCK;
  lock.l_whence = SEEK_SET;
  return lock;
}

}  // namespace

std::optional<FileStatus> file_status(const std::string& path) {
  struct stat status {};
  if (::stat(path.c_str(), &status) != 0) return std::nullopt;
  return status_of(status);
}

std::optional<FileVersion> file_version(const std::string& path) {
  const auto status = file_status(path);
  if (!status || status->type != FileType::kRegular) return std::nullopt;
  return status->version;
}

bool is_disk_full(int code) { return code == ENOSPC || code == EDQUOT || code == EFBIG; }

bool may_write(const std::string& path) { return ::access(path.c_str(), W_OK) == 0; }

bool may_write_in_folder(const std::string& path) {
  return ::access(path.c_str(), W_OK | X_OK) == 0;
}

void remove_file(const std::string& path) { ::unlink(path.c_str()); }

bool replace_file(const std::string& from, const std::string& to) {
  return retry_on_eintr([&] { return ::rename(from.c_str(), to.c_str()); }) == 0;
}

void sync_folder(const std::string& folder) {
  const int opened =
      retry_on_eintr([&] { return ::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC); });
  if (opened < 0) return;
  retry_on_eintr([&] { return ::fsync(opened); });
  ::close(opened);
}

bool is_open_to_write(int descriptor) {
  const int flags = ::fcntl(descriptor, F_GETFL);
  return flags >= 0 && (flags & O_ACCMODE) != O_RDONLY;
}

void FileUnmapper::operator()(std::byte* memory) const { ::munmap(memory, bytes); }

SystemFile::SystemFile(const std::string& path, Mode mode)
    : descriptor_(retry_on_eintr([&] {
        return ::open(path.c_str(), flags_of(mode) | O_CLOEXEC,
                      mode == Mode::kCreate ? 0666 : 0644);
      })) {}

SystemFile SystemFile::duplicate(int descriptor) {
  SystemFile file;
  file.descriptor_ = retry_on_eintr([&] { return ::fcntl(descriptor, F_DUPFD_CLOEXEC, 0); });
  return file;
}

SystemFile SystemFile::unnamed(std::string pattern) {
  SystemFile file;
  file.descriptor_ = ::mkostemp(pattern.data(), O_CLOEXEC);
  if (file.is_open() && ::unlink(pattern.c_str()) != 0) file.close();
  return file;
}

void SystemFile::close() {
  if (is_open()) ::close(std::exchange(descriptor_, -1));
}

std::optional<FileStatus> SystemFile::status() const {
  struct stat status {};
  if (::fstat(descriptor_, &status) != 0) return std::nullopt;
  return status_of(status);
}

std::optional<std::size_t> SystemFile::read_at(std::uint64_t offset,
                                               std::span<std::byte> into) const {
  std::size_t done = 0;
  while (done < into.size()) {
    const auto got = retry_on_eintr([&] {
      return ::pread(descriptor_, into.data() + done, into.size() - done,
                     static_cast<off_t>(offset + done));
    });
    if (got < 0) return std::nullopt;
    if (got == 0) break;
    done += static_cast<std::size_t>(got);
  }
  return done;
}

bool SystemFile::write(std::span<const std::byte> bytes) const {
  return transfer_all(bytes.size(), [&](std::size_t at, std::size_t left) {
    return ::write(descriptor_, bytes.data() + at, left);
  });
}

bool SystemFile::write_at(std::uint64_t offset, std::span<const std::byte> bytes) const {
  return transfer_all(bytes.size(), [&](std::size_t at, std::size_t left) {
    return ::pwrite(descriptor_, bytes.data() + at, left, static_cast<off_t>(offset + at));
  });
}

bool SystemFile::truncate(std::uint64_t bytes) const {
  return retry_on_eintr([&] { return ::ftruncate(descriptor_, static_cast<off_t>(bytes)); }) == 0;
}

bool SystemFile::allocate(std::uint64_t bytes) const {
  errno = ::posix_fallocate(descriptor_, 0, static_cast<off_t>(bytes));
  return errno == 0;
}

bool SystemFile::sync() const {
  return retry_on_eintr([&] { return ::fsync(descriptor_); }) == 0;
}

bool SystemFile::sync_bytes() const {
  return retry_on_eintr([&] { return ::fdatasync(descriptor_); }) == 0;
}

bool SystemFile::lock() const {
  struct flock lock = lock_of_file();
  return ::fcntl(descriptor_, F_OFD_SETLK, &lock) == 0;
}

bool SystemFile::is_locked() const {
  struct flock lock = lock_of_file();
  return ::fcntl(descriptor_, F_OFD_GETLK, &lock) == 0 && lock.l_type != F_UNLCK;
}

FileMapping SystemFile::map_to_read(std::size_t bytes) const {
  // Private, because some network file systems allow no other; no page is ever written and copied.
  void* const mapped = ::mmap(nullptr, bytes, PROT_READ, MAP_PRIVATE, descriptor_, 0);
  if (mapped == MAP_FAILED) return nullptr;
  // Read-around by the kernel adds 128 kB per range on many machines and 8 MB on some.
  ::madvise(mapped, bytes, MADV_RANDOM);
  return {static_cast<std::byte*>(mapped), FileUnmapper{bytes}};
}

FileMapping SystemFile::map_to_write(std::size_t bytes) const {
  void* const mapped = ::mmap(nullptr, bytes, PROT_READ | PROT_WRITE, MAP_SHARED, descriptor_, 0);
  if (mapped == MAP_FAILED) return nullptr;
  return {static_cast<std::byte*>(mapped), FileUnmapper{bytes}};
}

void SystemFile::map_again(const FileMapping& mapping, std::span<std::byte> pages) const {
  if (::mmap(pages.data(), pages.size(), PROT_READ, MAP_PRIVATE | MAP_FIXED, descriptor_,
             pages.data() - mapping.get()) != MAP_FAILED)
    ::madvise(pages.data(), pages.size(), MADV_RANDOM);
}

void SystemFile::will_need(std::uint64_t offset, std::uint64_t bytes) const {
  ::posix_fadvise(descriptor_, static_cast<off_t>(offset), static_cast<off_t>(bytes),
                  POSIX_FADV_WILLNEED);
}

void SystemFile::will_need(std::span<std::byte> pages) {
  ::madvise(pages.data(), pages.size(), MADV_WILLNEED);
}

void SystemFile::release(std::span<std::byte> bytes) {
  const auto page_bytes = static_cast<std::uintptr_t>(::sysconf(_SC_PAGESIZE));
  const auto begin = reinterpret_cast<std::uintptr_t>(bytes.data());
  const std::uintptr_t first = (begin + page_bytes - 1) / page_bytes * page_bytes,
                       last = (begin + bytes.size()) / page_bytes * page_bytes;
  if (first < last) ::madvise(bytes.data() + (first - begin), last - first, MADV_DONTNEED);
}

}  // namespace clamor
