// system_file.cpp: files by Windows, with descriptors of the C library.
#include "common/platform/system_file.h"

#include <algorithm>
#include <cerrno>

#include <fcntl.h>
#include <io.h>

#include "common/platform/windows/win32.h"

namespace clamor {

namespace {

constexpr DWORD kShared = FILE_SHARE_READ | FILE_SHARE_WRITE | FILE_SHARE_DELETE;
constexpr std::size_t kMost_bytes = std::size_t{1} << 30;  // of one call

HANDLE handle_of(int descriptor) { return reinterpret_cast<HANDLE>(::_get_osfhandle(descriptor)); }

// -1 with errno if there is no file.
int descriptor_of(HANDLE file) {
  if (file == INVALID_HANDLE_VALUE) {
    fail_by_last_error();
    return -1;
  }
  const int descriptor = ::_open_osfhandle(reinterpret_cast<std::intptr_t>(file), _O_BINARY);
  if (descriptor < 0) ::CloseHandle(file);
  return descriptor;
}

DWORD high(std::uint64_t value) { return static_cast<DWORD>(value >> 32); }
DWORD low(std::uint64_t value) { return static_cast<DWORD>(value); }

OVERLAPPED at(std::uint64_t offset) {
  OVERLAPPED place{};
  place.Offset = low(offset);
  place.OffsetHigh = high(offset);
  return place;
}

// Calls place_of(done) for where each part belongs.
template <class PlaceOf>
bool write_all(HANDLE file, std::span<const std::byte> bytes, const PlaceOf& place_of) {
  for (std::size_t done = 0; done < bytes.size();) {
    OVERLAPPED place = place_of(done);
    DWORD now = 0;
    if (::WriteFile(file, bytes.data() + done,
                    static_cast<DWORD>(std::min(bytes.size() - done, kMost_bytes)), &now,
                    &place) == 0)
      return fail_by_last_error();
    done += now;
  }
  return true;
}

std::uint64_t joined(DWORD high, DWORD low) { return std::uint64_t{high} << 32 | low; }

std::optional<FileStatus> status_of(HANDLE file) {
  FileStatus status;
  switch (::GetFileType(file)) {
    case FILE_TYPE_CHAR:
      status.type = FileType::kCharacterDevice;
      return status;
    case FILE_TYPE_PIPE:
      status.type = FileType::kPipe;
      return status;
    default:
      break;
  }
  BY_HANDLE_FILE_INFORMATION known{};
  if (::GetFileInformationByHandle(file, &known) == 0) {
    fail_by_last_error();
    return std::nullopt;
  }
  constexpr std::int64_t kTicksTo1970 = 116'444'736'000'000'000;  // of 100 ns, since 1601
  status.type = (known.dwFileAttributes & FILE_ATTRIBUTE_DIRECTORY) != 0 ? FileType::kFolder
                                                                         : FileType::kRegular;
  const auto ticks = static_cast<std::int64_t>(
      joined(known.ftLastWriteTime.dwHighDateTime, known.ftLastWriteTime.dwLowDateTime));
  status.version = {known.dwVolumeSerialNumber, joined(known.nFileIndexHigh, known.nFileIndexLow),
                    joined(known.nFileSizeHigh, known.nFileSizeLow), (ticks - kTicksTo1970) * 100};
  return status;
}

// Locks keep others from reading and writing what is locked, so a byte is locked that no file has.
constexpr std::uint64_t kLockedByte = ~std::uint64_t{0} - 1;

bool lock_byte(HANDLE file) {
  OVERLAPPED place = at(kLockedByte);
  return ::LockFileEx(file, LOCKFILE_EXCLUSIVE_LOCK | LOCKFILE_FAIL_IMMEDIATELY, 0, 1, 0, &place) !=
         0;
}

FileMapping map(HANDLE file, std::size_t bytes, bool to_write) {
  const HANDLE section =
      ::CreateFileMappingW(file, nullptr, to_write ? PAGE_READWRITE : PAGE_READONLY, 0, 0, nullptr);
  if (section == nullptr) {
    fail_by_last_error();
    return nullptr;
  }
  void* const mapped =
      ::MapViewOfFile(section, to_write ? FILE_MAP_WRITE : FILE_MAP_READ, 0, 0, bytes);
  if (mapped == nullptr) fail_by_last_error();
  ::CloseHandle(section);
  return {static_cast<std::byte*>(mapped), FileUnmapper{bytes}};
}

}  // namespace

std::optional<FileStatus> file_status(const std::string& path) {
  const HANDLE file = ::CreateFileW(wide_path(path).c_str(), FILE_READ_ATTRIBUTES, kShared, nullptr,
                                    OPEN_EXISTING, FILE_FLAG_BACKUP_SEMANTICS, nullptr);
  if (file == INVALID_HANDLE_VALUE) {
    fail_by_last_error();
    return std::nullopt;
  }
  const auto status = status_of(file);
  ::CloseHandle(file);
  return status;
}

std::optional<FileVersion> file_version(const std::string& path) {
  const auto status = file_status(path);
  if (!status || status->type != FileType::kRegular) return std::nullopt;
  return status->version;
}

bool is_disk_full(int code) { return code == ENOSPC || code == EFBIG; }

bool may_write(const std::string& path) {
  constexpr int kToWrite = 2;
  return ::_waccess(wide_path(path).c_str(), kToWrite) == 0;
}

// Only the attempt tells whether a new file is allowed.
bool may_write_in_folder(const std::string& path) {
  return ::_waccess(wide_path(path).c_str(), 0) == 0;
}

void remove_file(const std::string& path) { ::DeleteFileW(wide_path(path).c_str()); }

bool replace_file(const std::string& from, const std::string& to) {
  return ::MoveFileExW(wide_path(from).c_str(), wide_path(to).c_str(),
                       MOVEFILE_REPLACE_EXISTING | MOVEFILE_WRITE_THROUGH) != 0 ||
         fail_by_last_error();
}

// replace_file() does it.
void sync_folder(const std::string&) {}

bool is_open_to_write(int descriptor) { return handle_of(descriptor) != INVALID_HANDLE_VALUE; }

void FileUnmapper::operator()(std::byte* memory) const { ::UnmapViewOfFile(memory); }

SystemFile::SystemFile(const std::string& path, Mode mode) {
  DWORD access = GENERIC_WRITE, creation = OPEN_EXISTING;
  switch (mode) {
    case Mode::kRead:
      access = GENERIC_READ;
      break;
    case Mode::kCreate:
      access = GENERIC_WRITE | GENERIC_READ;
      creation = CREATE_NEW;
      break;
    case Mode::kUpdate:
      access = GENERIC_WRITE | GENERIC_READ;
      creation = OPEN_ALWAYS;
      break;
    case Mode::kStream:
      break;
  }
  descriptor_ = descriptor_of(::CreateFileW(wide_path(path).c_str(), access, kShared, nullptr,
                                            creation, FILE_ATTRIBUTE_NORMAL, nullptr));
}

SystemFile SystemFile::duplicate(int descriptor) {
  SystemFile file;
  file.descriptor_ = ::_dup(descriptor);
  return file;
}

SystemFile SystemFile::unnamed(std::string pattern) {
  SystemFile file;
  try_names(pattern, [&file](const std::string& path) {
    file.descriptor_ = descriptor_of(::CreateFileW(
        wide_path(path).c_str(), GENERIC_READ | GENERIC_WRITE | DELETE, kShared, nullptr,
        CREATE_NEW, FILE_ATTRIBUTE_TEMPORARY | FILE_FLAG_DELETE_ON_CLOSE, nullptr));
    return file.is_open();
  });
  return file;
}

void SystemFile::close() {
  if (is_open()) ::_close(std::exchange(descriptor_, -1));
}

std::optional<FileStatus> SystemFile::status() const { return status_of(handle_of(descriptor_)); }

std::optional<std::size_t> SystemFile::read_at(std::uint64_t offset,
                                               std::span<std::byte> into) const {
  std::size_t done = 0;
  while (done < into.size()) {
    OVERLAPPED place = at(offset + done);
    DWORD got = 0;
    if (::ReadFile(handle_of(descriptor_), into.data() + done,
                   static_cast<DWORD>(std::min(into.size() - done, kMost_bytes)), &got,
                   &place) == 0) {
      if (::GetLastError() == ERROR_HANDLE_EOF) break;
      fail_by_last_error();
      return std::nullopt;
    }
    if (got == 0) break;
    done += got;
  }
  return done;
}

// Other than on POSIX systems, reads and writes elsewhere move the place of the next write, so it
// goes to the end.
bool SystemFile::write(std::span<const std::byte> bytes) const {
  return write_all(handle_of(descriptor_), bytes,
                   [](std::size_t) { return at(~std::uint64_t{0}); });
}

bool SystemFile::write_at(std::uint64_t offset, std::span<const std::byte> bytes) const {
  return write_all(handle_of(descriptor_), bytes,
                   [offset](std::size_t done) { return at(offset + done); });
}

bool SystemFile::truncate(std::uint64_t bytes) const {
  FILE_END_OF_FILE_INFO end{};
  end.EndOfFile.QuadPart = static_cast<LONGLONG>(bytes);
  return ::SetFileInformationByHandle(handle_of(descriptor_), FileEndOfFileInfo, &end,
                                      sizeof end) != 0 ||
         fail_by_last_error();
}

bool SystemFile::allocate(std::uint64_t bytes) const {
  const auto now = status();
  return now && (now->version.bytes >= bytes || truncate(bytes));
}

bool SystemFile::sync() const {
  return ::FlushFileBuffers(handle_of(descriptor_)) != 0 || fail_by_last_error();
}

bool SystemFile::sync_bytes() const { return sync(); }

bool SystemFile::lock() const { return lock_byte(handle_of(descriptor_)) || fail_by_last_error(); }

bool SystemFile::is_locked() const {
  const HANDLE file = handle_of(descriptor_);
  if (!lock_byte(file)) return ::GetLastError() == ERROR_LOCK_VIOLATION;
  OVERLAPPED place = at(kLockedByte);
  ::UnlockFileEx(file, 0, 1, 0, &place);
  return false;
}

FileMapping SystemFile::map_to_read(std::size_t bytes) const {
  return map(handle_of(descriptor_), bytes, false);
}

FileMapping SystemFile::map_to_write(std::size_t bytes) const {
  return map(handle_of(descriptor_), bytes, true);
}

void SystemFile::map_again(const FileMapping&, std::span<std::byte>) const {}

// Windows has no hint for bytes of a file.
void SystemFile::will_need(std::uint64_t, std::uint64_t) const {}

void SystemFile::will_need(std::span<std::byte>) {}

// Unlocking pages that are not locked fails and takes them out of the working set.
void SystemFile::release(std::span<std::byte> bytes) {
  ::VirtualUnlock(bytes.data(), bytes.size());
}

}  // namespace clamor
