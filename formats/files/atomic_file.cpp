#include "formats/files/atomic_file.h"

#include <array>
#include <cerrno>
#include <csignal>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <utility>
#include <vector>

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include "common/system_reason.h"
#include "formats/files/retry_on_eintr.h"

namespace clamor {

namespace {

Error failed(const std::string& path, const std::string& doing, int code) {
  const char* advice = code == ENOSPC || code == EDQUOT || code == EFBIG
                           ? "free some space or choose another disk"
                       : code == EPIPE ? "what read it has ended"
                                       : "choose a place you may write to";
  return Error(path + ": cannot " + doing + " (" + system_reason(code) + "); " + advice);
}

std::string folder_of(const std::string& path) {
  const auto folder = std::filesystem::path(path).parent_path();
  return folder.empty() ? "." : folder.string();
}

// Temporaries are named PATH.HOST.PROCESS.tmp.
std::string prefix_of(const std::string& path) {
  std::array<char, 256> host{};
  if (::gethostname(host.data(), host.size() - 1) != 0) host[0] = '\0';
  return path + "." + host.data() + ".";
}

void remove_stale_temporaries(const std::string& path) {
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

AtomicFile::AtomicFile(std::string path, OutputTarget target, std::string temporary, int descriptor)
    : path_(std::move(path)),
      target_(std::move(target)),
      temporary_(std::move(temporary)),
      descriptor_(descriptor) {}

AtomicFile::AtomicFile(AtomicFile&& other) noexcept
    : ByteSink(),
      path_(std::move(other.path_)),
      target_(std::move(other.target_)),
      temporary_(std::move(other.temporary_)),
      descriptor_(std::exchange(other.descriptor_, -1)),
      has_appeared_(other.has_appeared_) {}

AtomicFile& AtomicFile::operator=(AtomicFile&& other) noexcept {
  std::swap(path_, other.path_);
  std::swap(target_, other.target_);
  std::swap(temporary_, other.temporary_);
  std::swap(descriptor_, other.descriptor_);
  std::swap(has_appeared_, other.has_appeared_);
  return *this;
}

AtomicFile::~AtomicFile() {
  if (descriptor_ < 0) return;
  ::close(descriptor_);
  if (!temporary_.empty()) ::unlink(temporary_.c_str());
}

Result<AtomicFile> AtomicFile::create(const std::string& path) {
  auto target = OutputTarget::find(path);
  if (!target.ok()) return target.error();
  if (target->is_stream()) {
    std::string temporary = target->temporary_prefix() + "-XXXXXX";
    const int descriptor = ::mkostemp(temporary.data(), O_CLOEXEC);
    if (descriptor < 0) return failed(temporary, "make a temporary file", errno);
    ::unlink(temporary.c_str());
    return AtomicFile(path, std::move(*target), "", descriptor);
  }
  remove_stale_temporaries(target->file());
  // The name contains the process id, so an existing file is left from a process that ended.
  const std::string temporary = prefix_of(target->file()) + std::to_string(::getpid()) + ".tmp";
  ::unlink(temporary.c_str());
  const int descriptor = retry_on_eintr(
      [&] { return ::open(temporary.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0666); });
  if (descriptor < 0) return failed(path, "write here", errno);
  return AtomicFile(path, std::move(*target), temporary, descriptor);
}

Result<void> AtomicFile::write(std::span<const std::byte> bytes) {
  const bool done = transfer_all(bytes.size(), [&](std::size_t at, std::size_t left) {
    return ::write(descriptor_, bytes.data() + at, left);
  });
  return done ? Result<void>() : Result<void>(failed(path_, "write", errno));
}

Result<void> AtomicFile::write_at(std::size_t offset, std::span<const std::byte> bytes) {
  const bool done = transfer_all(bytes.size(), [&](std::size_t at, std::size_t left) {
    return ::pwrite(descriptor_, bytes.data() + at, left, static_cast<off_t>(offset + at));
  });
  return done ? Result<void>() : Result<void>(failed(path_, "write", errno));
}

// Copies the temporary to the stream; later writes go to the stream directly.
Result<void> AtomicFile::copy_to_stream() {
  const auto stream = target_.open_stream();
  if (!stream.ok()) return stream.error();
  const int from = std::exchange(descriptor_, *stream);
  std::vector<std::byte> part(std::size_t{1} << 16);
  Result<void> copied;
  for (off_t offset = 0; copied.ok();) {
    const ssize_t got =
        retry_on_eintr([&] { return ::pread(from, part.data(), part.size(), offset); });
    if (got < 0) copied = failed(path_, "read the temporary file", errno);
    if (got <= 0) break;
    copied = write(std::span(part).first(static_cast<std::size_t>(got)));
    offset += got;
  }
  ::close(from);
  return copied;
}

Result<void> AtomicFile::appear() {
  has_appeared_ = true;
  if (is_stream()) return copy_to_stream();
  if (retry_on_eintr([&] { return ::rename(temporary_.c_str(), target_.file().c_str()); }) != 0)
    return failed(path_, "write here", errno);
  temporary_.clear();
  sync_folder_of(target_.file());
  return {};
}

Result<void> AtomicFile::commit() {
  if (!is_stream() && retry_on_eintr([&] { return ::fsync(descriptor_); }) != 0)
    return failed(path_, "write", errno);
  if (!has_appeared_)
    if (const auto appeared = appear(); !appeared.ok()) return appeared;
  ::close(std::exchange(descriptor_, -1));
  return {};
}

void sync_folder_of(const std::string& path) {
  const int folder = retry_on_eintr(
      [&] { return ::open(folder_of(path).c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC); });
  if (folder < 0) return;
  retry_on_eintr([&] { return ::fsync(folder); });
  ::close(folder);
}

Result<void> write_file(const std::string& path, std::string_view text) {
  auto file = AtomicFile::create(path);
  if (!file.ok()) return file.error();
  if (auto written = file->write(std::as_bytes(std::span(text))); !written.ok()) return written;
  return file->commit();
}

}  // namespace clamor
