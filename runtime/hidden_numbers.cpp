#include "runtime/hidden_numbers.h"

#include <cstddef>
#include <utility>

namespace clamor {

namespace {

constexpr std::size_t kFirstWords = 1 << 10;

}  // namespace

HiddenNumbers::HiddenNumbers() : words_(kFirstWords) {}

void HiddenNumbers::set(std::uint64_t number, bool hidden) {
  const std::uint64_t word = number / 64, bit = std::uint64_t{1} << (number % 64);
  Word* here = const_cast<Word*>(&find(word));
  if (here->key == 0) {
    if (!hidden) return;
    if (2 * ++count_ > words_.size()) {
      std::vector<Word> old(2 * words_.size());
      words_.swap(old);
      for (const Word& one : old)
        if (one.key != 0) const_cast<Word&>(find(one.key - 1)) = one;
      here = const_cast<Word*>(&find(word));
    }
    here->key = word + 1;
  }
  here->bits = hidden ? here->bits | bit : here->bits & ~bit;
}

void HiddenNumbers::clear() {
  words_.assign(kFirstWords, Word{});
  count_ = 0;
}

}  // namespace clamor
