#include "runtime/occlusion/occlusion_upper_bounds.h"

#include <utility>

namespace clamor {

namespace {

constexpr std::size_t kMinSlots = 1 << 8;

}  // namespace

OcclusionUpperBounds::OcclusionUpperBounds() : slots_(kMinSlots), rows_(1) {}

void OcclusionUpperBounds::set(std::uint64_t number, std::uint8_t step) {
  const std::uint64_t key = number / kRow;
  Slot* here = const_cast<Slot*>(&find(key));
  if (here->key == 0) {
    if (step == kUnoccluded) return;
    if (2 * (rows_.size() + 1) > slots_.size()) {
      std::vector<Slot> old(2 * slots_.size());
      slots_.swap(old);
      for (const Slot& one : old)
        if (one.key != 0) const_cast<Slot&>(find(one.key - 1)) = one;
      here = const_cast<Slot*>(&find(key));
    }
    *here = {key + 1, static_cast<std::uint32_t>(rows_.size())};
    rows_.emplace_back();
  }
  const std::uint64_t shift = 4 * (number % kPerWord);
  std::uint32_t& word = rows_[here->row][number % kRow / kPerWord];
  word = (word & ~(15u << shift)) | std::uint32_t{step} << shift;
}

void OcclusionUpperBounds::clear() {
  slots_.assign(kMinSlots, Slot{});
  rows_.assign(1, Row{});
}

}  // namespace clamor
