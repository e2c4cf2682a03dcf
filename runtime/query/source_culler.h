// source_culler.h: culls those of a few hundred sources that cannot reach a priority at a place, in
// vectors.
//
// The upper bound of a source's priority (radiation_model.h) is
//
//   (diffuse cos o + bounce x exp(-slope x) + lobe min(1, cos o / cos i) exp(-fall (1 - cos a)))
//   / max(r, radius)^2,   x = min(cos o, 1 / slope).
//
// Sources lie in blocks of 16, by descending key. Most blocks are culled as a whole, 16 at a time,
// by their box and their highest parts; of the others each source is culled first by its distance
// and then by its direction.
//
// Single precision, in metres from the middle of the sources. All rounding errs towards keeping a
// source: distances by a margin, directions by the angle asin(margin / r), sums by a slack. So no
// source is culled that a sum in double precision would keep.
//
// Immutable once made.   Memory: 78 bytes per source.
#pragma once

#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "common/vec.h"
#include "runtime/propagation/band_mix.h"
#include "runtime/realtime/prefetch.h"

namespace clamor {

// What the culler knows of a source. An emitter is all lobe, and radiates to all sides.
struct CullSource {
  Vec3f position_m{}, normal{}, mirror{};
  float radius_m = 0, diffuse = 0, bounce = 0, slope = 0, lobe = 0, fall = 0;
  bool is_emitter = false;
  // Handed on; the culler itself uses none of these.
  float delay_s = 0;
  std::uint32_t emitter = 0;
  BandMix mix;
};

// Upper bounds then hold within `radius_m` of the place. The bound of the distance is the tightest
// for sources that are `distance_m` away.
struct CullMargin {
  double radius_m = 0, distance_m = 1;
};

inline constexpr std::size_t kCullerSources = 512, kCullBlock = 16;

// The sources that were kept, one bit each, and their upper bounds. `tested` sources were not
// culled with their block.
struct CullResult {
  std::array<std::uint64_t, kCullerSources / 64> bits;
  std::array<float, kCullerSources> upper_bound;
  std::uint32_t tested;

  // Calls passed(index, upper bound), ascending.
  template <class Passed>
  void for_each(const Passed& passed) const {
    for (std::size_t word = 0; word < bits.size(); ++word)
      for (std::uint64_t rest = bits[word]; rest != 0; rest &= rest - 1) {
        const std::size_t index = 64 * word + static_cast<std::size_t>(std::countr_zero(rest));
        passed(index, static_cast<double>(upper_bound[index]));
      }
  }
};

// 16 sources, as structure of arrays; vectors are rows of x, y and z.
struct alignas(64) CullBlock {
  using Row = std::array<float, kCullBlock>;
  std::array<Row, 3> position_m{}, normal{}, mirror{};
  Row radius2_m2{}, diffuse{}, bounce{}, lobe{}, fall{};
  Row slope{};  // -1: an emitter
  Row delay_s{};
  std::array<std::uint32_t, kCullBlock> emitter{};
  std::array<BandMix, kCullBlock> mix{};
};

// One source of a block, without its directions.
struct CullRecord {
  float radius2_m2 = 0, diffuse = 0, bounce = 0, lobe = 0, fall = 0;
  float slope = 0;  // -1: an emitter
  float delay_s = 0;
  std::uint32_t emitter = 0;
  BandMix mix;
  Vec3 position_m{};  // rounded to single precision
};

// Bounds of 16 blocks, likewise.
struct alignas(64) CullBounds {
  using Row = CullBlock::Row;
  std::array<Row, 3> middle_m{}, half_m{};  // of boxes
  Row radius2_m2{}, diffuse{}, bounce{}, slope{}, lobe{};
};

class SourceCuller {
 public:
  // At most kCullerSources, by descending key.
  explicit SourceCuller(std::span<const CullSource> sources);

  // Keeps those whose priority at `place` may be `threshold` or more.
  void cull(const Vec3& place, double threshold, CullResult& result,
            const CullMargin& margin = CullMargin()) const;

  CullRecord record(std::size_t index) const {
    const CullBlock& block = blocks_[index / kCullBlock];
    const std::size_t at = index % kCullBlock;
    return {block.radius2_m2[at],
            block.diffuse[at],
            block.bounce[at],
            block.lobe[at],
            block.fall[at],
            block.slope[at],
            block.delay_s[at],
            block.emitter[at],
            block.mix[at],
            middle_m_ +
                Vec3(block.position_m[0][at], block.position_m[1][at], block.position_m[2][at])};
  }

  void prefetch() const { prefetch_to_read(bounds_.data(), bounds_.size() * sizeof(CullBounds)); }

  std::size_t bytes() const {
    return sizeof *this + blocks_.size() * sizeof(CullBlock) + bounds_.size() * sizeof(CullBounds);
  }

 private:
  std::uint32_t count_ = 0;
  Vec3 middle_m_{};
  double extent_m_ = 0;
  std::vector<CullBlock> blocks_;
  std::vector<CullBounds> bounds_;
};

// The upper bound of one source in double precision; that of cull() is higher by at most this
// factor and the margin of positions.
inline constexpr double kCullSlack = 1.003;
double priority_upper_bound(const CullSource& source, const Vec3& place);

}  // namespace clamor
