// source_page.h: sources that are neighbours, laid out to be culled in vectors: which of them can
// reach a priority at a place?
//
// Sources lie in blocks of 16. Most blocks are culled as a whole, 16 at a time, by their box and
// the highest bound of their sources in any direction (source_bound.h); of the others, each source
// by its own bound. No source that can reach the priority is lost in any order of the sources;
// culling is fastest if they are sorted by descending key.
//
// Positions are in single precision, in metres from the middle of the sources. Their rounding is
// added to the radius of cull(), so no source is culled that double precision would keep.
//
// Immutable once made.   Memory: 150 bytes per source. Huge pages (madvise) make a keyframe 5 %
// faster without its rays, with ten million sources, and first loading a fifth slower: not worth
// it.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "common/bands.h"
#include "common/vec.h"
#include "runtime/propagation/band_mix.h"
#include "runtime/propagation/radiation_model.h"
#include "runtime/propagation/source_bound.h"

namespace clamor {

inline constexpr std::size_t kCullBlock = 16;

// 16 SourceBounds, as structure of arrays; vectors are rows of x, y and z.
struct alignas(64) CullBlock {
  using Row = std::array<float, kCullBlock>;
  std::array<Row, 3> position_m{}, normal{}, mirror{};
  Row radius2_m2{}, diffuse{}, compensation{}, lobe{}, fall{}, slope{};
  std::array<BandMix, kCullBlock> mix{};

  void set(std::size_t at, const SourceBound& bound, const Vec3f& place_m, BandMix bands);
};

// CullBounds holds 16 blocks as structure of arrays: the box of each, its smallest patch radius,
// squared, and the highest bound of its sources at 1 m in any direction.
struct alignas(64) CullBounds {
  using Row = CullBlock::Row;
  std::array<Row, 3> low_m{}, high_m{};
  Row radius2_m2{}, peak{};
};

// The sources that were not culled, ascending, with the upper bounds of their priorities.
struct CulledPage {
  std::size_t count = 0;
  std::vector<std::uint32_t> index;  // padded by one vector
  std::vector<float> upper_bound;
  std::size_t tested = 0;  // sources that were not culled with their block

  // Removes all, and makes room for so many.
  void begin(std::size_t max_count);
};

class SourcePage {
 public:
  // The priority is the sum over bands of intensity times weights[signal], times the late boost,
  // over u. `bounding`: others at the same places, of which the page holds the bounds instead.
  SourcePage(const RadiationModel& radiation, std::span<const Bands> weights,
             std::vector<Source> sources, std::span<const Source> bounding = {});

  std::size_t size() const { return sources_.size(); }
  const Source& operator[](std::size_t index) const { return sources_[index]; }
  const Source* data() const { return sources_.data(); }
  std::size_t bytes() const;

  // Finds every source whose priority may reach `threshold` within `radius_m` of `place`.
  void cull(const Vec3& place, double radius_m, double threshold, CulledPage& culled) const;

  // Returns a source's bound without its late boost, at the position as it is stored.
  SourceBound bound(std::size_t index) const;
  BandMix mix(std::size_t index) const {
    return blocks_[index / kCullBlock].mix[index % kCullBlock];
  }

  static void prefetch(const Source& source) {
    __builtin_prefetch(&source);
    __builtin_prefetch(&source + 1);  // a source lies across two cache lines
  }

 private:
  std::vector<Source> sources_;
  Vec3 middle_m_{};
  double extent_m_ = 0;
  std::vector<CullBlock> blocks_;
  std::vector<CullBounds> bounds_;
};

}  // namespace clamor
