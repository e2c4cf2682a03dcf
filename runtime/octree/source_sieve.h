// source_sieve.h: which of a few hundred sources could reach a priority at a place, in vectors.
//
// Knows of each source a ceiling of its priority (source_field.h),
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
#include "runtime/field/band_mix.h"
#include "runtime/realtime/prefetch.h"

namespace clamor {

// One as the sieve sees it. An emitter is all lobe, and is heard on all sides.
struct SieveSource {
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
struct SieveGive {
  double place_m = 0, about_m = 1;
};

inline constexpr std::size_t kSieveSources = 512, kSieveBlock = 16;

// What got through: a bit for each source, and the ceilings of those. `looked_at` were not left out
// with their block.
struct Sifted {
  std::array<std::uint64_t, kSieveSources / 64> bits;
  std::array<float, kSieveSources> ceiling;
  std::array<std::uint16_t, kSieveSources> slot;  // where in the sieve: for SourceSieve::part()
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
struct alignas(64) SieveBlock {
  using Row = std::array<float, kSieveBlock>;
  std::array<Row, 3> position_m{}, normal{}, mirror{};
  Row radius2_m2{}, diffuse{}, bounce{}, lobe{}, fall{};
  Row slope{};  // -1: an emitter
  Row delay_s{};
  std::array<std::uint32_t, kSieveBlock> index{}, emitter{};
  std::array<BandMix, kSieveBlock> mix{};
};

// What is known of a source without touching it.
struct SievePart {
  float radius2_m2 = 0, diffuse = 0, bounce = 0, lobe = 0, fall = 0;
  float slope = 0;  // -1: an emitter
  float delay_s = 0;
  std::uint32_t emitter = 0;
  BandMix mix;
  Vec3 position_m{};  // within the give of positions
};

// The same of 16 blocks: what none of their sources exceeds.
struct alignas(64) SieveBounds {
  using Row = SieveBlock::Row;
  std::array<Row, 3> middle_m{}, half_m{}, normal{}, mirror{};  // axes of cones, boxes
  Row normal_cos{}, normal_sin{}, mirror_cos{}, mirror_sin{};   // of half angles
  Row radius2_m2{}, diffuse{}, bounce{}, slope{}, lobe{}, fall{};
};

class SourceSieve {
 public:
  // At most kSieveSources, by descending key.
  explicit SourceSieve(std::span<const SieveSource> sources);

  // Those whose priority at `place` may be `threshold` or more.
  void sift(const Vec3& place, double threshold, Sifted& sifted,
            const SieveGive& give = SieveGive()) const;

  // What the ceiling of one is made of, its directions aside.
  SievePart part(std::size_t slot) const {
    const SieveBlock& block = blocks_[slot / kSieveBlock];
    const std::size_t at = slot % kSieveBlock;
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

  void prefetch() const { prefetch_to_read(bounds_.data(), bounds_.size() * sizeof(SieveBounds)); }

  std::size_t bytes() const {
    return sizeof *this + blocks_.size() * sizeof(SieveBlock) +
           bounds_.size() * sizeof(SieveBounds);
  }

 private:
  std::uint32_t count_ = 0;
  Vec3 middle_m_{};
  double extent_m_ = 0;
  std::vector<SieveBlock> blocks_;
  std::vector<SieveBounds> bounds_;
};

// The same for one source at a time, in double precision: below what sift() gives by at most
// kSieveSlack, and the give of positions.
inline constexpr double kSieveSlack = 1.003;
double sieve_ceiling(const SieveSource& source, const Vec3& place);

}  // namespace clamor
