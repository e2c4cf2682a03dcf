#include "tests/checksums.h"

#include <cstddef>
#include <cstdint>
#include <span>
#include <utility>

#define HASH_OF "_ZN6clamor7hash_ofESt4spanIKSt4byteLm18446744073709551615EE"

// Names that the linker gives hash_of() with --wrap.
std::uint64_t own_hash_of(std::span<const std::byte> bytes) asm("__real_" HASH_OF);
std::uint64_t wrapped_hash_of(std::span<const std::byte> bytes) asm("__wrap_" HASH_OF);

namespace clamor::testing {
bool checksums_are_off = false;
std::function<void()> after_checksum;
}  // namespace clamor::testing

std::uint64_t wrapped_hash_of(std::span<const std::byte> bytes) {
  const std::uint64_t sum = clamor::testing::checksums_are_off ? 0x1234567 : own_hash_of(bytes);
  if (const auto then = std::exchange(clamor::testing::after_checksum, nullptr)) then();
  return sum;
}
