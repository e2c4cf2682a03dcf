#include "bake/octree/source_thinning.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <utility>

#include "common/random.h"
#include "common/thread_team.h"

namespace clamor {

namespace {

// A run almost never has more deposits.
constexpr std::size_t kSlack = 10'000, kMaxAtOnce = 100'000;

// Hash of the deposit, uniform in (0, 1].
double thinning_random(const Source& source) {
  const std::uint64_t where =
      (std::uint64_t{std::bit_cast<std::uint32_t>(source.position_m.x)} << 32) |
      std::bit_cast<std::uint32_t>(source.position_m.y);
  const RandomBits bits = philox(
      where, {std::bit_cast<std::uint32_t>(source.u), std::bit_cast<std::uint32_t>(source.delay_s),
              std::bit_cast<std::uint32_t>(source.position_m.z),
              static_cast<std::uint32_t>(Use::kThinning)});
  return unit_above_zero(bits[0]);
}

double weight_of(const Source& source, SourceThinning::Weight weight) {
  const double root = std::sqrt(sum_of(source.power));
  return weight == SourceThinning::Weight::kSquareRoot ? root : std::sqrt(root);
}

}  // namespace

SourceThinning::SourceThinning(std::uint64_t max_sources, Weight weight)
    : max_sources_(max_sources), weight_(weight) {}

double SourceThinning::key_of(const Source& source, Weight weight) {
  return weight_of(source, weight) / thinning_random(source);
}

void SourceThinning::scale(Source& source, double threshold, Weight weight) {
  const double of_source = weight_of(source, weight);
  if (of_source >= threshold) return;
  for (float& band : source.power) band = static_cast<float>(band * (threshold / of_source));
}

// Higher keys first; ties are broken by order of arrival.
bool SourceThinning::before(const Entry& a, const Entry& b) {
  if (a.key != b.key) return a.key > b.key;
  if (a.order != b.order) return a.order < b.order;
  return a.rank < b.rank;
}

void SourceThinning::add(std::span<const Source> deposits, std::uint64_t order) {
  // Reserved at once, because doubling would need twice the memory at the peak.
  const std::size_t room = max_sources_ + max_sources_ / 8 + kSlack + kMaxAtOnce;
  if (added_ == 0) {
    entries_.reserve(room);
    sources_.reserve(room);
  }
  added_ += deposits.size();
  for (std::size_t i = 0; i < deposits.size(); ++i) {
    const double key = key_of(deposits[i], weight_);
    if (key < threshold_) continue;  // too low: the kept sources all have higher keys
    if (live_ == entries_.size()) {
      entries_.push_back({0, 0, 0, static_cast<std::uint32_t>(live_)});
      sources_.emplace_back();
    }
    Entry& entry = entries_[live_++];
    entry = {key, order, static_cast<std::uint32_t>(i), entry.slot};
    sources_[entry.slot] = deposits[i];
  }
  if (live_ > room - kMaxAtOnce) prune();
}

void SourceThinning::prune() {
  if (live_ <= max_sources_) return;
  const auto begin = entries_.begin(), cut = begin + static_cast<std::ptrdiff_t>(max_sources_);
  std::nth_element(begin, cut, begin + static_cast<std::ptrdiff_t>(live_), before);
  threshold_ = std::max(threshold_, cut->key);
  live_ = max_sources_;
}

std::vector<Source> SourceThinning::take() {
  prune();
  entries_.resize(live_);
  team_sort(entries_.begin(), entries_.end(), [](const Entry& a, const Entry& b) {
    return a.order != b.order ? a.order < b.order : a.rank < b.rank;
  });
  // Sorts in place, since there may be no memory for a second list. Source i is swapped with the
  // one in its slot; the displaced source is later found through entry i's slot.
  for (std::size_t i = 0; i < live_; ++i) {
    std::uint32_t& slot = entries_[i].slot;
    while (slot < i) slot = entries_[slot].slot;
    std::swap(sources_[i], sources_[slot]);
    scale(sources_[i], threshold_, weight_);
  }
  sources_.resize(live_);
  entries_ = std::vector<Entry>();  // assigning {} would keep the capacity
  live_ = 0;
  return std::exchange(sources_, std::vector<Source>());
}

}  // namespace clamor
