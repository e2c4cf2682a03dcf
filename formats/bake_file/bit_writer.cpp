#include "formats/bake_file/bit_writer.h"

#include <algorithm>
#include <bit>

namespace clamor {

namespace {

std::uint32_t zigzag(std::uint32_t value) {
  return value << 1 ^ static_cast<std::uint32_t>(static_cast<std::int32_t>(value) >> 31);
}

std::uint32_t as_bits(std::int32_t value) { return static_cast<std::uint32_t>(value); }

int field_of(int bits) { return std::min(bits, 31); }  // 0 to 30, or 31 for 32
int storable(int bits) { return bits == 31 ? 32 : bits; }

struct Plan {
  ColumnKind kind = kEven;
  int k = 0;
  std::uint32_t base = 0;
  std::uint64_t bits = 0;  // without the common header
};

std::uint32_t number_of(const Plan& plan, std::int32_t value) {
  const std::uint32_t above = as_bits(value) - plan.base;
  return plan.kind == kSigned ? zigzag(above) : above;
}

int base_bits(std::uint32_t base) { return storable(std::bit_width(zigzag(base))); }

// Finds the best k of a Rice code about a base. The search ends when the k bits alone exceed the
// best size so far, and passes over a k whose unary parts would exceed it even if all of the low
// bits that they leave out were ones.
Plan best_rice(std::span<const std::int32_t> values, ColumnKind kind, std::uint32_t base,
               std::uint64_t at_most) {
  Plan best{kind, 0, base, at_most};
  std::uint64_t sum = 0;
  for (const std::int32_t value : values) sum += number_of(best, value);
  for (int k = 0; k <= 30; ++k) {
    Plan plan{kind, k, base, 0};
    const std::uint64_t without_unary = static_cast<std::uint64_t>(base_bits(base)) +
                                        values.size() * static_cast<std::uint64_t>(k + 1);
    if (without_unary >= best.bits) break;
    const std::uint64_t left_out = values.size() * ((std::uint64_t{1} << k) - 1);
    if (sum > left_out && without_unary + ((sum - left_out) >> k) >= best.bits) continue;
    plan.bits = without_unary;
    for (const std::int32_t value : values) plan.bits += number_of(plan, value) >> k;
    if (plan.bits < best.bits) best = plan;
  }
  return best;
}

Plan plan_of(std::span<const std::int32_t> values) {
  const auto [least, most] = std::minmax_element(values.begin(), values.end());
  Plan even;
  even.base = as_bits(*least);
  even.k = storable(std::bit_width(as_bits(*most) - as_bits(*least)));
  even.bits = static_cast<std::uint64_t>(base_bits(even.base)) +
              values.size() * static_cast<std::uint64_t>(even.k);
  if (even.k == 0) return even;
  Plan best = even;
  std::vector<std::int32_t> sorted(values.begin(), values.end());
  const auto middle = sorted.begin() + static_cast<std::ptrdiff_t>(sorted.size() / 2);
  std::nth_element(sorted.begin(), middle, sorted.end());
  for (const Plan& plan : {best_rice(values, kSmall, as_bits(*least), best.bits),
                           best_rice(values, kSigned, as_bits(*middle), best.bits),
                           best_rice(values, kSigned, 0, best.bits)})
    if (plan.bits < best.bits) best = plan;
  return best;
}

}  // namespace

void BitWriter::put(std::uint32_t value, int bits) {
  pending_ |= std::uint64_t{value} << pending_bits_;
  pending_bits_ += bits;
  for (; pending_bits_ >= 8; pending_bits_ -= 8, pending_ >>= 8)
    bytes_.push_back(static_cast<std::byte>(pending_ & 255));
}

void BitWriter::put_column(std::span<const std::int32_t> values) {
  if (values.empty()) return;
  const Plan plan = plan_of(values);
  put(plan.kind, 2);
  put(static_cast<std::uint32_t>(field_of(plan.k)), 5);
  put(static_cast<std::uint32_t>(field_of(base_bits(plan.base))), 5);
  put(zigzag(plan.base), base_bits(plan.base));
  for (const std::int32_t value : values) put(number_of(plan, value) & low_bits(plan.k), plan.k);
  if (plan.kind == kEven) return;
  for (const std::int32_t value : values) {
    std::uint32_t zeros = number_of(plan, value) >> plan.k;
    for (; zeros >= 32; zeros -= 32) put(0, 32);
    put(1u << zeros, static_cast<int>(zeros) + 1);
  }
}

std::vector<std::byte> BitWriter::take() {
  if (pending_bits_ > 0) put(0, 8 - pending_bits_);
  return std::move(bytes_);
}

std::uint64_t column_bits(std::span<const std::int32_t> values) {
  return values.empty() ? 0 : 12 + plan_of(values).bits;
}

}  // namespace clamor
