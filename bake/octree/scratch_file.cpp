#include "bake/octree/scratch_file.h"

#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <utility>

#include <fcntl.h>
#include <sys/mman.h>
#include <unistd.h>

#include "common/system_reason.h"

namespace clamor {

ScratchFile::ScratchFile(ScratchFile&& other) noexcept
    : beside_(std::move(other.beside_)),
      bytes_(std::exchange(other.bytes_, 0)),
      descriptor_(std::exchange(other.descriptor_, -1)),
      mapped_(std::exchange(other.mapped_, {})) {}

ScratchFile& ScratchFile::operator=(ScratchFile&& other) noexcept {
  std::swap(beside_, other.beside_);
  std::swap(bytes_, other.bytes_);
  std::swap(descriptor_, other.descriptor_);
  std::swap(mapped_, other.mapped_);
  return *this;
}

ScratchFile::~ScratchFile() {
  if (!mapped_.empty()) ::munmap(mapped_.data(), mapped_.size());
  if (descriptor_ >= 0) ::close(descriptor_);
}

Error ScratchFile::failed(const char* doing) const {
  const int code = errno;
  const bool full = code == ENOSPC || code == EDQUOT || code == EFBIG;
  return Error(beside_ + ": cannot " + doing + " the temporary file for sources that exceed the " +
               "memory (" + system_reason(code) + "); " +
               (full ? "free some space, choose another disk or allow more memory"
                     : "choose a place you may write to or allow more memory"));
}

Result<void> ScratchFile::open() {
  std::string name = beside_ + ".sources-XXXXXX";
  descriptor_ = ::mkostemp(name.data(), O_CLOEXEC);
  if (descriptor_ < 0) return failed("make");
  if (::unlink(name.c_str()) != 0) return failed("hide");
  return {};
}

Result<void> ScratchFile::append(std::span<const std::byte> bytes) {
  if (descriptor_ < 0 && !bytes.empty())
    if (const auto opened = open(); !opened.ok()) return opened;
  while (!bytes.empty()) {
    const ssize_t written = ::write(descriptor_, bytes.data(), bytes.size());
    if (written < 0 && errno == EINTR) continue;
    if (written < 0) return failed("write");
    bytes_ += static_cast<std::uint64_t>(written);
    bytes = bytes.subspan(static_cast<std::size_t>(written));
  }
  return {};
}

Result<void> ScratchFile::read(std::uint64_t offset, std::span<std::byte> bytes) const {
  while (!bytes.empty()) {
    const ssize_t got =
        ::pread(descriptor_, bytes.data(), bytes.size(), static_cast<off_t>(offset));
    if (got < 0 && errno == EINTR) continue;
    if (got == 0) errno = EIO;  // unexpected end: another process changed the file
    if (got <= 0) return failed("read");
    bytes = bytes.subspan(static_cast<std::size_t>(got));
    offset += static_cast<std::uint64_t>(got);
  }
  return {};
}

Result<std::span<std::byte>> ScratchFile::map(std::uint64_t bytes) {
  if (bytes == 0) return std::span<std::byte>();
  if (const auto opened = open(); !opened.ok()) return opened.error();
  // A full disk has to be an error now, not a signal later.
  if ((errno = ::posix_fallocate(descriptor_, 0, static_cast<off_t>(bytes))) != 0)
    return failed("write");
  void* const memory = ::mmap(nullptr, bytes, PROT_READ | PROT_WRITE, MAP_SHARED, descriptor_, 0);
  if (memory == MAP_FAILED) return failed("map");
  mapped_ = {static_cast<std::byte*>(memory), bytes};
  bytes_ = bytes;
  return mapped_;
}

}  // namespace clamor
