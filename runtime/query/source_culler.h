// source_culler.h: which of a few hundred sources could reach a priority at a place, in vectors.
//
// Knows of each source a ceiling of its priority (radiation_model.h),
//
//   (diffuse cos o + bounce x exp(-slope x) + lobe min(1, cos o / cos i) exp(-fall (1 - cos a)))
//   / max(r, radius)^2,   x = min(cos o, 1 / slope),
//
// and asks it in two stages. Sources lie in blocks of 16, sorted first by key, coarsely, and then
// by direction of their lobes, so that the lobes of a block share a narrow cone: most blocks are
// left out at once by box, cones and highest parts, 16 blocks at a time; of the rest first the
// distance of each source is looked at, then its direction. (Design, section 5.)
//
// Single precision, in metres from the middle of the sources. Whatever rounds, rounds towards
// letting a source through: distances by `give`, directions by the angle asin(give / r), the sum by
// kSlack. So no source is ever left out that a sum in double precision would let through.
//
// Immutable once made. Memory: 82 bytes per source.
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

// One as the sieve sees it. An emitter is all lobe, and is heard on all sides.
struct CullSource {
  Vec3f position_m{}, normal{}, mirror{};
  float radius_m = 0, diffuse = 0, bounce = 0, slope = 0, lobe = 0, fall = 0;
  bool is_emitter = false;
  // Handed on: the sieve itself asks for none of it.
  float delay_s = 0;
  std::uint32_t emitter = 0;
  BandMix mix;
};

// Ceilings that hold for every place within `place_m` of the one that is asked about. They are the
// tightest for sources that are `about_m` away.
struct CullMargin {
  double place_m = 0, about_m = 1;
};

inline constexpr std::size_t kCullerSources = 512, kCullBlock = 16;

// What got through: a bit for each source, and the ceilings of those. `looked_at` were not left out
// with their block.
struct CullResult {
  std::array<std::uint64_t, kCullerSources / 64> bits;
  std::array<float, kCullerSources> ceiling;
  std::array<std::uint16_t, kCullerSources> slot;  // where in the sieve: for SourceCuller::part()
  std::uint32_t looked_at;

  // Calls passed(index, ceiling), ascending.
  template <class Passed>
  void for_each(const Passed& passed) const {
    for (std::size_t word = 0; word < bits.size(); ++word)
      for (std::uint64_t rest = bits[word]; rest != 0; rest &= rest - 1) {
        const std::size_t index = 64 * word + static_cast<std::size_t>(std::countr_zero(rest));
        passed(index, static_cast<double>(ceiling[index]));
      }
  }
};

// 16 sources, each number of all of them side by side; directions of x, then y, then z.
struct alignas(64) CullBlock {
  using Row = std::array<float, kCullBlock>;
  std::array<Row, 3> position_m{}, normal{}, mirror{};
  Row radius2_m2{}, diffuse{}, bounce{}, lobe{}, fall{};
  Row slope{};  // -1: an emitter
  Row delay_s{};
  std::array<std::uint32_t, kCullBlock> index{}, emitter{};
  std::array<BandMix, kCullBlock> mix{};
};

// What is known of a source without touching it.
struct CullRecord {
  float radius2_m2 = 0, diffuse = 0, bounce = 0, lobe = 0, fall = 0;
  float slope = 0;  // -1: an emitter
  float delay_s = 0;
  std::uint32_t emitter = 0;
  BandMix mix;
  Vec3 position_m{};  // within the give of positions
};

// The same of 16 blocks: what none of their sources exceeds.
struct alignas(64) CullBounds {
  using Row = CullBlock::Row;
  std::array<Row, 3> middle_m{}, half_m{}, normal{}, mirror{};  // axes of cones, boxes
  Row normal_cos{}, normal_sin{}, mirror_cos{}, mirror_sin{};   // of half angles
  Row radius2_m2{}, diffuse{}, bounce{}, slope{}, lobe{}, fall{};
};

class SourceCuller {
 public:
  // At most kCullerSources, by descending key.
  explicit SourceCuller(std::span<const CullSource> sources);

  // Those whose priority at `place` may be `threshold` or more.
  void sift(const Vec3& place, double threshold, CullResult& sifted,
            const CullMargin& give = CullMargin()) const;

  // What the ceiling of one is made of, its directions aside.
  CullRecord part(std::size_t slot) const {
    const CullBlock& block = blocks_[slot / kCullBlock];
    const std::size_t at = slot % kCullBlock;
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

// The same for one source at a time, in double precision: below what sift() gives by at most
// kCullSlack, and the give of positions.
inline constexpr double kCullSlack = 1.003;
double priority_upper_bound(const CullSource& source, const Vec3& place);

}  // namespace clamor
