#include "formats/atomic_file.h"

#include <array>
#include <cerrno>
#include <csignal>
#include <cstring>
#include <filesystem>
#include <utility>

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include "formats/unless_interrupted.h"

namespace clamor {

namespace {

Error failed(const std::string& path, const std::string& doing, int code) {
  const char* advice = code == ENOSPC || code == EDQUOT || code == EFBIG
                           ? "free some space or choose another disk"
                           : "choose a place you may write to";
  return Error(path + ": cannot " + doing + " (" + std::strerror(code) + "); " + advice);
}

std::string folder_of(const std::string& path) {
  const auto folder = std::filesystem::path(path).parent_path();
  return folder.empty() ? "." : folder.string();
}

// Temporaries are called PATH.HOST.PROCESS.tmp.
std::string prefix_of(const std::string& path) {
  std::array<char, 256> host{};
  if (::gethostname(host.data(), host.size() - 1) != 0) host[0] = '\0';
  return path + "." + host.data() + ".";
}

void remove_what_killed_processes_left(const std::string& path) {
  const std::string prefix = std::filesystem::path(prefix_of(path)).filename().string();
  std::error_code ignored;
  for (const auto& entry : std::filesystem::directory_iterator(folder_of(path), ignored)) {
    const std::string name = entry.path().filename().string();
    if (!name.starts_with(prefix) || !name.ends_with(".tmp")) continue;
    const std::string process = name.substr(prefix.size(), name.size() - prefix.size() - 4);
    if (process.empty() || process.size() > 9 ||
        process.find_first_not_of("0123456789") != std::string::npos)
      continue;
    if (::kill(std::stoi(process), 0) != 0 && errno == ESRCH) ::unlink(entry.path().c_str());
  }
}

}  // namespace

AtomicFile::AtomicFile(std::string path, std::string temporary, int descriptor)
    : path_(std::move(path)), temporary_(std::move(temporary)), descriptor_(descriptor) {}

AtomicFile::AtomicFile(AtomicFile&& other) noexcept
    : path_(std::move(other.path_)),
      temporary_(std::move(other.temporary_)),
      descriptor_(std::exchange(other.descriptor_, -1)) {}

AtomicFile& AtomicFile::operator=(AtomicFile&& other) noexcept {
  std::swap(path_, other.path_);
  std::swap(temporary_, other.temporary_);
  std::swap(descriptor_, other.descriptor_);
  return *this;
}

AtomicFile::~AtomicFile() {
  if (descriptor_ < 0) return;
  ::close(descriptor_);
  ::unlink(temporary_.c_str());
}

Result<AtomicFile> AtomicFile::create(const std::string& path) {
  // A rename would put a file in the place of whatever is there, a device among them.
  struct stat status {};
  if (::stat(path.c_str(), &status) == 0 && S_ISDIR(status.st_mode))
    return failed(path, "write a file", EISDIR);
  if (::stat(path.c_str(), &status) == 0 && !S_ISREG(status.st_mode))
    return Error(path + ": is a device or a pipe, not a file; name a file to write");
  remove_what_killed_processes_left(path);
  // The process's own name for it, so what lies there is left from a process that is gone.
  const std::string temporary = prefix_of(path) + std::to_string(::getpid()) + ".tmp";
  ::unlink(temporary.c_str());
  const int descriptor = unless_interrupted(
      [&] { return ::open(temporary.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0644); });
  if (descriptor < 0) return failed(path, "write here", errno);
  return AtomicFile(path, temporary, descriptor);
}

Result<void> AtomicFile::write(std::span<const std::byte> bytes) {
  while (!bytes.empty()) {
    const ssize_t written =
        unless_interrupted([&] { return ::write(descriptor_, bytes.data(), bytes.size()); });
    // Of no bytes: there is no room for one, and the file system does not say so.
    if (written <= 0) return failed(path_, "write", written < 0 ? errno : ENOSPC);
    bytes = bytes.subspan(static_cast<std::size_t>(written));
  }
  return {};
}

Result<void> AtomicFile::write_at(std::size_t offset, std::span<const std::byte> bytes) {
  while (!bytes.empty()) {
    const ssize_t written = unless_interrupted([&] {
      return ::pwrite(descriptor_, bytes.data(), bytes.size(), static_cast<off_t>(offset));
    });
    // Of no bytes: there is no room for one, and the file system does not say so.
    if (written <= 0) return failed(path_, "write", written < 0 ? errno : ENOSPC);
    bytes = bytes.subspan(static_cast<std::size_t>(written));
    offset += static_cast<std::size_t>(written);
  }
  return {};
}

Result<void> AtomicFile::commit() {
  if (unless_interrupted([&] { return ::fsync(descriptor_); }) != 0)
    return failed(path_, "write", errno);
  if (unless_interrupted([&] { return ::rename(temporary_.c_str(), path_.c_str()); }) != 0)
    return failed(path_, "write here", errno);
  ::close(std::exchange(descriptor_, -1));
  sync_folder_of(path_);
  return {};
}

void sync_folder_of(const std::string& path) {
  const int folder = unless_interrupted(
      [&] { return ::open(folder_of(path).c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC); });
  if (folder < 0) return;
  unless_interrupted([&] { return ::fsync(folder); });
  ::close(folder);
}

}  // namespace clamor
