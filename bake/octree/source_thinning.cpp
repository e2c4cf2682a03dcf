#include "bake/octree/source_thinning.h"

#include <algorithm>
#include <bit>
#include <utility>
#include <vector>

#include "common/random.h"

namespace clamor {

namespace {

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

void scale(Source& source, double factor) {
  if (!(factor > 1)) return;
  for (float& band : source.power) band = static_cast<float>(band * factor);
}

// The key that `higher` of the keys precede in descending order, by radix selection. Keys are not
// negative, so that their bits are in the order of their values.
double key_after(ScratchList<double>& keys, std::size_t higher) {
  constexpr int kDigit = 13, kFirstShift = 52;  // 13 bits at 52, 39, 26, 13 and 0
  std::uint64_t known = 0, known_mask = 0;
  std::vector<std::uint64_t> counts;
  for (int shift = kFirstShift; shift >= 0; shift -= kDigit) {
    constexpr std::uint64_t kMask = (1u << kDigit) - 1;
    counts.assign(kMask + 1, 0);
    keys.for_blocks([&](std::span<const double> block, std::size_t) {
      for (const double key : block)
        if (const auto bits = std::bit_cast<std::uint64_t>(key); (bits & known_mask) == known)
          ++counts[bits >> shift & kMask];
    });
    std::uint64_t digit = kMask;
    while (higher >= counts[digit]) higher -= counts[digit--];
    known |= digit << shift;
    known_mask |= kMask << shift;
  }
  return std::bit_cast<double>(known);
}

}  // namespace

SourceThinning::SourceThinning(std::uint64_t max_sources, const DepositWeight& weight,
                               double speed_mps)
    : max_sources_(max_sources),
      room_(max_sources + max_sources / 8 + 10'000),
      weight_(weight),
      speed_mps_(speed_mps) {}

Result<void> SourceThinning::use_file(const std::string& beside) {
  sources_ = ScratchList<Source>(beside);
  keys_ = ScratchList<double>(beside);
  if (auto room = sources_.reserve(room_); !room.ok()) return room;
  return keys_.reserve(room_);
}

void SourceThinning::add(std::span<const Source> deposits, double threshold) {
  if (added_ == 0 && !sources_.is_in_file()) {
    // Reserved at once, because doubling would need twice the memory at the peak.
    (void)sources_.reserve(room_);
    (void)keys_.reserve(room_);
  }
  added_ += deposits.size();
  for (const Source& deposit : deposits) {
    const auto path_m = static_cast<float>(deposit.delay_s * speed_mps_);
    const double weight = std::max<double>(weight_.of(deposit.power, path_m), threshold);
    const double key = odds_of(weight) / thinning_random(deposit);
    if (key < dropped_) continue;  // too low: the kept sources all have higher keys
    if (keys_.size() == room_) prune();
    (void)sources_.append({&deposit, 1});  // cannot fail, as there is room
    (void)keys_.append({&key, 1});
  }
}

void SourceThinning::prune() {
  if (keys_.size() <= max_sources_) return;
  dropped_ = key_after(keys_, max_sources_);
  std::size_t equal = max_sources_;  // sources of this key that are kept
  keys_.for_blocks([&](std::span<const double> block, std::size_t) {
    for (const double key : block) equal -= key > dropped_ ? 1 : 0;
  });
  std::size_t kept = 0;
  const std::span<Source> sources = sources_.all();
  keys_.for_blocks([&](std::span<const double> block, std::size_t first) {
    const std::size_t before = kept;
    for (std::size_t i = 0; i < block.size(); ++i) {
      if (block[i] < dropped_ || (block[i] == dropped_ && equal == 0)) continue;
      if (block[i] == dropped_) --equal;
      sources[kept] = sources[first + i];
      keys_.all()[kept++] = block[i];
    }
    sources_.release(first, block.size());
    sources_.release(before, kept - before);
    keys_.release(before, kept - before);
  });
  (void)sources_.resize(kept);
  (void)keys_.resize(kept);
}

ScratchList<Source> SourceThinning::take() {
  prune();
  sources_.for_blocks([&](std::span<Source> block, std::size_t first) {
    for (std::size_t i = 0; i < block.size(); ++i)
      scale(block[i], dropped_ / (keys_.all()[first + i] * thinning_random(block[i])));
    keys_.release(first, block.size());
  });
  keys_ = ScratchList<double>();
  return std::exchange(sources_, ScratchList<Source>());
}

}  // namespace clamor
