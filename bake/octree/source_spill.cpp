#include "bake/octree/source_spill.h"

#include <algorithm>
#include <cassert>
#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <type_traits>
#include <utility>

#include <fcntl.h>
#include <unistd.h>

namespace clamor {

static_assert(std::is_trivially_copyable_v<Source>, "its bytes are what is written");

SourceSpill::SourceSpill(std::string beside, std::size_t buffered_sources)
    : beside_(std::move(beside)), buffered_sources_(std::max<std::size_t>(1, buffered_sources)) {}

SourceSpill::SourceSpill(SourceSpill&& other) noexcept
    : beside_(std::move(other.beside_)),
      buffered_sources_(other.buffered_sources_),
      buffer_(std::move(other.buffer_)),
      count_(std::exchange(other.count_, 0)),
      low_m_(other.low_m_),
      high_m_(other.high_m_),
      highest_(other.highest_),
      descriptor_(std::exchange(other.descriptor_, -1)) {}

SourceSpill& SourceSpill::operator=(SourceSpill&& other) noexcept {
  std::swap(beside_, other.beside_);
  std::swap(buffered_sources_, other.buffered_sources_);
  std::swap(buffer_, other.buffer_);
  std::swap(count_, other.count_);
  std::swap(low_m_, other.low_m_);
  std::swap(high_m_, other.high_m_);
  std::swap(highest_, other.highest_);
  std::swap(descriptor_, other.descriptor_);
  return *this;
}

SourceSpill::~SourceSpill() {
  if (descriptor_ >= 0) ::close(descriptor_);
}

Error SourceSpill::failed(const char* doing) const {
  const int code = errno;
  const bool full = code == ENOSPC || code == EDQUOT || code == EFBIG;
  return Error(beside_ + ": cannot " + doing + " the temporary file for sources that exceed the " +
               "memory (" + std::strerror(code) + "); " +
               (full ? "free some space, choose another disk or allow more memory"
                     : "choose a place you may write to or allow more memory"));
}

Result<void> SourceSpill::open() {
  std::string name = beside_ + ".sources-XXXXXX";
  descriptor_ = ::mkostemp(name.data(), O_CLOEXEC);
  if (descriptor_ < 0) return failed("make");
  if (::unlink(name.c_str()) != 0) return failed("hide");
  return {};
}

Result<void> SourceSpill::write(std::span<const Source> sources) {
  if (descriptor_ < 0 && !sources.empty())
    if (const auto opened = open(); !opened.ok()) return opened;
  auto bytes = std::as_bytes(sources);
  while (!bytes.empty()) {
    const ssize_t written = ::write(descriptor_, bytes.data(), bytes.size());
    if (written < 0 && errno == EINTR) continue;
    if (written < 0) return failed("write");
    bytes = bytes.subspan(static_cast<std::size_t>(written));
  }
  return {};
}

Result<void> SourceSpill::append(std::span<const Source> sources) {
  if (sources.size() >= 0xffffffffu - count_)
    return Error(beside_ + ": would hold " + std::to_string(count_ + sources.size()) +
                 " sources, and an octree of more than 4294967294 cannot be built; keep fewer with "
                 "--sources, or use instances");
  if (count_ == 0 && !sources.empty()) low_m_ = high_m_ = sources.front().position_m;
  for (const Source& source : sources) {
    low_m_ = glm::min(low_m_, source.position_m);
    high_m_ = glm::max(high_m_, source.position_m);
    highest_.offer(octree_rank(key_bits(octree_key(source)), static_cast<std::uint32_t>(count_++)));
  }
  if (buffer_.size() + sources.size() <= buffered_sources_) {
    buffer_.insert(buffer_.end(), sources.begin(), sources.end());
    return {};
  }
  if (const auto written = write(buffer_); !written.ok()) return written;
  buffer_.clear();
  if (sources.size() >= buffered_sources_) return write(sources);
  buffer_.assign(sources.begin(), sources.end());
  return {};
}

Result<void> SourceSpill::flush() {
  const auto written = write(buffer_);
  buffer_ = std::vector<Source>();  // assigning {} would keep the capacity
  return written;
}

Result<void> SourceSpill::read(std::uint64_t first, std::span<Source> sources) const {
  assert(buffer_.empty() && first + sources.size() <= count_);
  auto bytes = std::as_writable_bytes(sources);
  auto offset = static_cast<off_t>(first * sizeof(Source));
  while (!bytes.empty()) {
    const ssize_t got = ::pread(descriptor_, bytes.data(), bytes.size(), offset);
    if (got < 0 && errno == EINTR) continue;
    if (got == 0) errno = EIO;  // unexpected end: another process changed the file
    if (got <= 0) return failed("read");
    bytes = bytes.subspan(static_cast<std::size_t>(got));
    offset += got;
  }
  return {};
}

}  // namespace clamor
