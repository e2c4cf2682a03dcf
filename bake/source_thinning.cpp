#include "bake/source_thinning.h"

#include <algorithm>
#include <bit>
#include <cmath>

#include "common/random.h"

namespace clamor {

namespace {

constexpr std::size_t kSlack = 200'000, kMostAtOnce = 100'000;  // a run leaves fewer, nearly always

double weight_of(const Source& source) {
  double power = 0;
  for (const float band : source.power) power += static_cast<double>(band);
  return std::sqrt(std::sqrt(power));
}

// In (0, 1], from what tells this deposit from all others.
double random_of(const Source& source) {
  const std::uint64_t where =
      (std::uint64_t{std::bit_cast<std::uint32_t>(source.position_m.x)} << 32) |
      std::bit_cast<std::uint32_t>(source.position_m.y);
  const RandomBits bits = philox(
      where, {std::bit_cast<std::uint32_t>(source.u), std::bit_cast<std::uint32_t>(source.delay_s),
              std::bit_cast<std::uint32_t>(source.position_m.z),
              static_cast<std::uint32_t>(Use::kThinning)});
  return unit_above_zero(bits[0]);
}

}  // namespace

SourceThinning::SourceThinning(std::uint64_t most_sources) : most_(most_sources) {}

// Higher keys first; equal ones by order, so that the choice is never open.
bool SourceThinning::before(const Entry& a, const Entry& b) {
  if (a.key != b.key) return a.key > b.key;
  if (a.order != b.order) return a.order < b.order;
  return a.rank < b.rank;
}

void SourceThinning::add(std::span<const Source> deposits, std::uint64_t order) {
  // At once: growing by doubling would take twice as much when it is fullest.
  if (added_ == 0) entries_.reserve(2 * most_ + kSlack);
  added_ += deposits.size();
  for (std::size_t i = 0; i < deposits.size(); ++i) {
    const double key = weight_of(deposits[i]) / random_of(deposits[i]);
    if (key < threshold_) continue;  // more than n are above it already
    entries_.push_back({key, order, i, deposits[i]});
  }
  if (entries_.size() > 2 * most_ + kSlack - kMostAtOnce) prune();
}

void SourceThinning::prune() {
  if (entries_.size() <= most_) return;
  const auto cut = entries_.begin() + static_cast<std::ptrdiff_t>(most_);
  std::nth_element(entries_.begin(), cut, entries_.end(), before);
  threshold_ = std::max(threshold_, cut->key);
  entries_.erase(cut, entries_.end());
}

std::vector<Source> SourceThinning::take() {
  prune();
  std::sort(entries_.begin(), entries_.end(), [](const Entry& a, const Entry& b) {
    return a.order != b.order ? a.order < b.order : a.rank < b.rank;
  });
  std::vector<Source> kept;
  kept.reserve(entries_.size());
  for (const Entry& entry : entries_) {
    Source& source = kept.emplace_back(entry.source);
    const double weight = weight_of(source);
    if (weight >= threshold_) continue;
    for (float& band : source.power) band = static_cast<float>(band * (threshold_ / weight));
  }
  entries_ = {};
  return kept;
}

}  // namespace clamor
