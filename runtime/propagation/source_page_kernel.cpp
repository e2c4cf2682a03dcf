#include "runtime/propagation/source_page_kernel.h"

#include <algorithm>
#include <bit>

#include "runtime/realtime/prefetch.h"

// Highway compiles what follows once per instruction set.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "runtime/propagation/source_page_kernel.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "runtime/propagation/source_bound_lanes-inl.h"

HWY_BEFORE_NAMESPACE();
namespace clamor {
namespace HWY_NAMESPACE {
namespace {

// Bits of those of at most 16 blocks that may hold a source that reaches the threshold.
HWY_INLINE std::uint32_t test_bounds(const CullBounds& bounds, std::size_t blocks,
                                     const CullQuery& query) {
  const Tag d;
  std::uint32_t which = 0;
  for (std::size_t at = 0; at < blocks; at += hn::Lanes(d)) {
    const Vectors above = from_to(load(bounds.high_m, at), query.listener_m);
    const Vectors below = from_to(load(bounds.low_m, at), query.listener_m);
    const auto outside = [&](Vector over, Vector under) {
      return hn::Max(hn::Max(over, hn::Neg(under)), hn::Zero(d));
    };
    const Vectors way = {outside(above.x, below.x), outside(above.y, below.y),
                         outside(above.z, below.z)};
    const auto near2 =
        nearest2(hn::Sqrt(dot(way, way)), load(bounds.radius2_m2, at), query.error_m);
    const auto peak = hn::Mul(load(bounds.peak, at), hn::Set(d, kBoundSlack));
    // The negated comparison keeps what is infinite.
    const auto reaches = hn::Not(hn::Lt(peak, hn::Mul(near2, hn::Set(d, query.threshold))));
    std::uint8_t bits[8] = {};
    hn::StoreMaskBits(d, hn::And(reaches, hn::FirstN(d, blocks - at)), bits);
    which |= (bits[0] | static_cast<std::uint32_t>(bits[1]) << 8) << at;
  }
  return which;
}

// `first` is the index of the block's first source.
HWY_INLINE void cull_block(const CullBlock& block, std::size_t first, std::size_t count,
                           const CullQuery& query, CulledPage& culled) {
  const Tag d;
  for (std::size_t at = 0; at < count; at += hn::Lanes(d)) {
    const auto bound = upper_bound_of(load_sources(block, at), query.listener_m, query.error_m);
    keep_reaching(bound, query.threshold, first + at, count - at, culled);
  }
}

void cull_all(std::span<const CullBounds> bounds, std::span<const CullBlock> blocks,
              std::size_t count, const CullQuery& query, CulledPage& culled) {
  for (std::size_t first = 0; first < blocks.size(); first += kCullBlock) {
    std::uint32_t bits =
        test_bounds(bounds[first / kCullBlock], std::min(kCullBlock, blocks.size() - first), query);
    for (; bits != 0; bits &= bits - 1) {
      const std::size_t b = first + static_cast<std::size_t>(std::countr_zero(bits));
      if (const std::uint32_t later = bits & (bits - 1); later != 0)
        prefetch_to_read(&blocks[first + static_cast<std::size_t>(std::countr_zero(later))],
                         sizeof(CullBlock));
      const std::size_t in_block = std::min(kCullBlock, count - b * kCullBlock);
      culled.tested += in_block;
      cull_block(blocks[b], b * kCullBlock, in_block, query, culled);
    }
  }
}

}  // namespace
}  // namespace HWY_NAMESPACE
}  // namespace clamor
HWY_AFTER_NAMESPACE();

#if HWY_ONCE

namespace clamor {

namespace {
HWY_EXPORT(cull_all);
}  // namespace

void cull_blocks(std::span<const CullBounds> bounds, std::span<const CullBlock> blocks,
                 std::size_t count, const CullQuery& query, CulledPage& culled) {
  culled.begin(count);
  HWY_DYNAMIC_DISPATCH(cull_all)(bounds, blocks, count, query, culled);
}

}  // namespace clamor

#endif
