#include "bake/octree/thinning_on_disk.h"

#include <algorithm>
#include <bit>
#include <functional>
#include <iterator>

#include "bake/octree/source_thinning.h"
#include "common/thread_team.h"

namespace clamor {

namespace {

constexpr auto kWeight = SourceThinning::Weight::kFourthRoot;
constexpr std::size_t kBlock = 16384;
// Sign, exponent and eight bits of the mantissa: 256 bins an octave.
constexpr int kShift = 64 - 20;
constexpr std::size_t kBins = std::size_t{1} << 20;

// Keys are not negative, so that their bits are in the order of their values.
std::size_t bin_of(double key) { return std::bit_cast<std::uint64_t>(key) >> kShift; }

std::vector<double> keys_of(std::span<const Source> sources) {
  std::vector<double> keys(sources.size());
  team_for(0, sources.size(), 2048,
           [&](std::size_t i) { keys[i] = SourceThinning::key_of(sources[i], kWeight); });
  return keys;
}

}  // namespace

ThinningOnDisk::ThinningOnDisk(std::uint64_t max_sources, const std::string& beside)
    : max_sources_(max_sources), file_(beside), key_file_(beside), histogram_(kBins) {}

Result<void> ThinningOnDisk::add(std::span<const Source> deposits) {
  added_ += deposits.size();
  buffer_.insert(buffer_.end(), deposits.begin(), deposits.end());
  return buffer_.size() < kBlock ? Result<void>() : flush();
}

Result<void> ThinningOnDisk::flush() {
  const std::vector<double> keys = keys_of(buffer_);
  for (const double key : keys) ++histogram_[bin_of(key)];
  if (auto written = key_file_.append(std::as_bytes(std::span(keys))); !written.ok())
    return written;
  auto written = file_.append(std::as_bytes(std::span(buffer_)));
  buffer_.clear();
  return written;
}

Result<void> ThinningOnDisk::finish() {
  if (auto flushed = flush(); !flushed.ok()) return flushed;
  buffer_ = std::vector<Source>();  // assigning {} would keep the capacity
  kept_ = std::min(added_, max_sources_);
  if (added_ <= max_sources_) return {};
  std::uint64_t above = 0;
  std::size_t bin = kBins - 1;
  while (above + histogram_[bin] <= max_sources_) above += histogram_[bin--];
  histogram_ = std::vector<std::uint64_t>();
  std::vector<double> block, keys;  // `keys` are those of the bin with the (n + 1)-th
  for (std::uint64_t first = 0; first < added_; first += block.size()) {
    block.resize(std::min<std::uint64_t>(kBlock, added_ - first));
    if (auto read =
            key_file_.read(first * sizeof(double), std::as_writable_bytes(std::span(block)));
        !read.ok())
      return read;
    std::copy_if(block.begin(), block.end(), std::back_inserter(keys),
                 [bin](double key) { return bin_of(key) == bin; });
  }
  const auto next = keys.begin() + static_cast<std::ptrdiff_t>(max_sources_ - above);
  std::nth_element(keys.begin(), next, keys.end(), std::greater<>());
  threshold_ = *next;
  const auto higher =
      std::count_if(keys.begin(), keys.end(), [this](double key) { return key > threshold_; });
  kept_of_equal_ = max_sources_ - above - static_cast<std::uint64_t>(higher);
  return {};
}

Result<void> ThinningOnDisk::for_each_kept(std::uint64_t every, const Visit& visit) const {
  const bool keeps_all = added_ <= max_sources_;
  std::uint64_t equal = 0;
  std::vector<Source> block;
  std::vector<double> keys;
  for (std::uint64_t first = 0; first < added_; first += every * kBlock) {
    block.resize(std::min<std::uint64_t>(kBlock, added_ - first));
    if (auto read = file_.read(first * sizeof(Source), std::as_writable_bytes(std::span(block)));
        !read.ok())
      return read;
    std::size_t count = keeps_all ? block.size() : 0;
    if (!keeps_all) {
      keys.resize(block.size());
      if (auto read =
              key_file_.read(first * sizeof(double), std::as_writable_bytes(std::span(keys)));
          !read.ok())
        return read;
    }
    for (std::size_t i = 0; i < keys.size(); ++i) {
      if (keys[i] < threshold_ || (keys[i] == threshold_ && equal++ >= kept_of_equal_)) continue;
      block[count] = block[i];
      SourceThinning::scale(block[count++], threshold_, kWeight);
    }
    if (auto visited = visit(std::span(block).first(count)); !visited.ok()) return visited;
  }
  return {};
}

Result<void> ThinningOnDisk::for_each(const Visit& visit) const { return for_each_kept(1, visit); }

Result<void> ThinningOnDisk::for_some(const Visit& visit) const {
  constexpr std::uint64_t kFewBlocks = 100;
  return for_each_kept(added_ / kBlock < kFewBlocks ? 1 : 10, visit);
}

}  // namespace clamor
