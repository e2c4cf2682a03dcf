#include "bake/octree/source_spill.h"

#include <algorithm>
#include <cassert>
#include <type_traits>
#include <utility>

namespace clamor {

static_assert(std::is_trivially_copyable_v<Source>, "its bytes are what is written");

SourceSpill::SourceSpill(std::string beside, std::size_t buffered_sources)
    : file_(std::move(beside)), buffered_sources_(std::max<std::size_t>(1, buffered_sources)) {}

SourceSpill::SourceSpill(SourceSpill&& other) noexcept
    : file_(std::move(other.file_)),
      buffered_sources_(other.buffered_sources_),
      buffer_(std::move(other.buffer_)),
      count_(std::exchange(other.count_, 0)),
      bounds_(std::exchange(other.bounds_, {})),
      highest_(other.highest_) {}

SourceSpill& SourceSpill::operator=(SourceSpill&& other) noexcept {
  std::swap(file_, other.file_);
  std::swap(buffered_sources_, other.buffered_sources_);
  std::swap(buffer_, other.buffer_);
  std::swap(count_, other.count_);
  std::swap(bounds_, other.bounds_);
  std::swap(highest_, other.highest_);
  return *this;
}

Result<void> SourceSpill::append(std::span<const Source> sources) {
  if (sources.size() >= 0xffffffffu - count_)
    return Error(beside() + ": would hold " + std::to_string(count_ + sources.size()) +
                 " sources, and an octree of more than 4294967294 cannot be built; keep fewer with "
                 "--sources, or use instances");
  for (const Source& source : sources) {
    bounds_.add(source.position_m);
    highest_.offer(octree_rank(key_bits(octree_key(source)), static_cast<std::uint32_t>(count_++)));
  }
  if (buffer_.size() + sources.size() <= buffered_sources_) {
    buffer_.insert(buffer_.end(), sources.begin(), sources.end());
    return {};
  }
  if (const auto written = file_.append(std::as_bytes(std::span(buffer_))); !written.ok())
    return written;
  buffer_.clear();
  if (sources.size() >= buffered_sources_) return file_.append(std::as_bytes(sources));
  buffer_.assign(sources.begin(), sources.end());
  return {};
}

Result<void> SourceSpill::flush() {
  const auto written = file_.append(std::as_bytes(std::span(buffer_)));
  buffer_ = std::vector<Source>();  // assigning {} would keep the capacity
  return written;
}

Result<void> SourceSpill::read(std::uint64_t first, std::span<Source> sources) const {
  assert(buffer_.empty() && first + sources.size() <= count_);
  return file_.read(first * sizeof(Source), std::as_writable_bytes(sources));
}

}  // namespace clamor
