#include "bake/octree/scratch_file.h"

#include <cerrno>
#include <utility>

#include "common/system_reason.h"

namespace clamor {

ScratchFile::ScratchFile(ScratchFile&& other) noexcept
    : beside_(std::move(other.beside_)),
      bytes_(std::exchange(other.bytes_, 0)),
      file_(std::move(other.file_)),
      mapped_(std::move(other.mapped_)) {}

ScratchFile& ScratchFile::operator=(ScratchFile&& other) noexcept {
  std::swap(beside_, other.beside_);
  std::swap(bytes_, other.bytes_);
  std::swap(file_, other.file_);
  std::swap(mapped_, other.mapped_);
  return *this;
}

Error ScratchFile::failed(const char* doing) const {
  const int code = errno;
  return Error(beside_ + ": cannot " + doing + " the temporary file for sources that exceed the " +
               "memory (" + system_reason(code) + "); " +
               (is_disk_full(code) ? "free some space, choose another disk or allow more memory"
                                   : "choose a place you may write to or allow more memory"));
}

Result<void> ScratchFile::open() {
  file_ = SystemFile::unnamed(beside_ + ".sources-XXXXXX");
  if (!file_.is_open()) return failed("make");
  return {};
}

Result<void> ScratchFile::append(std::span<const std::byte> bytes) {
  if (bytes.empty()) return {};
  if (!file_.is_open())
    if (const auto opened = open(); !opened.ok()) return opened;
  if (!file_.write(bytes)) return failed("write");
  bytes_ += bytes.size();
  return {};
}

Result<void> ScratchFile::read(std::uint64_t offset, std::span<std::byte> bytes) const {
  const auto got = file_.read_at(offset, bytes);
  if (got && *got == bytes.size()) return {};
  if (got) errno = EIO;  // unexpected end: another process changed the file
  return failed("read");
}

Result<std::span<std::byte>> ScratchFile::map(std::uint64_t bytes) {
  if (bytes == 0) return std::span<std::byte>();
  if (const auto opened = open(); !opened.ok()) return opened.error();
  // A full disk has to be an error now, not a signal later.
  if (!file_.allocate(bytes)) return failed("write");
  mapped_ = file_.map_to_write(bytes);
  if (mapped_ == nullptr) return failed("map");
  bytes_ = bytes;
  return std::span(mapped_.get(), bytes);
}

}  // namespace clamor
