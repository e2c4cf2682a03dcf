#include "runtime/occlusion/occlusion_upper_bounds.h"

namespace clamor {

namespace {

constexpr std::size_t kMinSlots = 1 << 8;

}  // namespace

OcclusionUpperBounds::OcclusionUpperBounds() : row_of_(kMinSlots), rows_(1) {}

void OcclusionUpperBounds::set(std::uint64_t number, std::uint8_t step) {
  std::uint32_t row = row_of(number);
  if (row == 0) {
    if (step == kUnoccluded) return;
    row = row_of_[number / kRow] = static_cast<std::uint32_t>(rows_.size());
    rows_.emplace_back();
  }
  const std::uint64_t shift = 4 * (number % kPerWord);
  std::uint32_t& word = rows_[row][number % kRow / kPerWord];
  word = (word & ~(15u << shift)) | std::uint32_t{step} << shift;
}

void OcclusionUpperBounds::clear() {
  row_of_.clear();
  rows_.assign(1, Row{});
}

}  // namespace clamor
