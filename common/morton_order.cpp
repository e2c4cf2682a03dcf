#include "common/morton_order.h"

#include <algorithm>
#include <utility>

#include "common/bounds.h"

namespace clamor {

namespace {

std::uint64_t spread(std::uint64_t bits) {  // inserts two zeros after each of 21 bits
  bits = (bits | bits << 32) & 0x1f00000000ffff;
  bits = (bits | bits << 16) & 0x1f0000ff0000ff;
  bits = (bits | bits << 8) & 0x100f00f00f00f00f;
  bits = (bits | bits << 4) & 0x10c30c30c30c30c3;
  return (bits | bits << 2) & 0x1249249249249249;
}

}  // namespace

std::uint64_t morton_code(const Vec3& steps) {
  return spread(static_cast<std::uint64_t>(steps.x)) |
         spread(static_cast<std::uint64_t>(steps.y)) << 1 |
         spread(static_cast<std::uint64_t>(steps.z)) << 2;
}

std::vector<std::size_t> morton_order(std::span<const Vec3> places) {
  const auto [low, high] = bounds_of(places);
  const double edge = std::max({high.x - low.x, high.y - low.y, high.z - low.z, 1e-9});
  std::vector<std::pair<std::uint64_t, std::size_t>> order;
  for (std::size_t i = 0; i < places.size(); ++i) {
    const Vec3 steps = (places[i] - low) / edge * static_cast<double>((1 << 21) - 1);
    order.emplace_back(morton_code(steps), i);
  }
  std::sort(order.begin(), order.end());
  std::vector<std::size_t> indices;
  for (const auto& [code, index] : order) indices.push_back(index);
  return indices;
}

}  // namespace clamor
