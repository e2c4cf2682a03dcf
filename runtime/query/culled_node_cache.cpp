#include "runtime/query/culled_node_cache.h"

#include <utility>

namespace clamor {

namespace {

// Beyond so many, those of where the listener was long ago are forgotten with all others.
constexpr std::size_t kMostNodes = 1 << 16;

}  // namespace

void CulledNodeCache::set(std::uint64_t key, const ValidityRegion& quiet) {
  std::size_t at = place_of(key);
  if (slots_[at].key == 0) {
    if (count_ == kMostNodes) clear();
    if (2 * ++count_ > slots_.size()) {
      std::vector<Slot> old(2 * slots_.size());
      slots_.swap(old);
      for (const Slot& slot : old)
        if (slot.key != 0) slots_[place_of(slot.key)] = slot;
    }
    at = place_of(key);
  }
  slots_[at] = {key, quiet};
}

void CulledNodeCache::clear() {
  slots_.assign(1 << 10, Slot{});
  count_ = 0;
}

}  // namespace clamor
