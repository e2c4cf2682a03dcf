// source_page.h: sources that are neighbours, laid out for choosing among them.
//
// Lets only those through that could reach a priority at a place, by three sieves, each cheaper and
// coarser than the next: the bounding box and highest ceiling of a block; distance and ceiling of
// each source, from packed arrays, in vectors; and the ceiling towards the place's direction
// (source_field.h). In any order of the sources it is as exact, and only slower.
//
// Immutable once made. Memory: 124 bytes per source.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "common/bands.h"
#include "common/vec.h"
#include "runtime/source_field.h"

namespace clamor {

// A permanent number below this counts as this, for the priority to stay finite.
inline constexpr float kLeastU = 0x1p-64f;

class SourcePage {
 public:
  // Priority is the sum of bands times weights[signal], over u.
  SourcePage(const SourceField& field, std::span<const Bands> weights, std::vector<Source> sources);

  std::size_t size() const { return sources_.size(); }
  const Source& operator[](std::size_t index) const { return sources_[index]; }
  std::size_t bytes() const;  // of memory

  // Calls found(index, ceiling), ascending, for every source whose priority at `place` is at least
  // `threshold`, and for a few more; `ceiling` is one of the priority. `field` is the
  // constructor's.
  template <class Found>
  void pass(const SourceField& field, const Vec3& place, double threshold,
            const Found& found) const {
    for (std::size_t b = 0; b < blocks_.size(); ++b) {
      std::uint8_t passes[kBlockSources];
      if (!screen(b, Vec3f(place), threshold, passes)) continue;
      const std::size_t first = b * kBlockSources;
      for (std::size_t i = 0; i < std::min(kBlockSources, size() - first); ++i)
        if (passes[i]) {
          const double ceiling = field.ceiling_at(sources_[first + i], ceilings_[first + i], place);
          if (ceiling >= threshold) found(first + i, ceiling);
        }
    }
  }

 private:
  static constexpr std::size_t kBlockSources = 128;

  // Ceilings are over u: of the priority.
  struct Block {
    Vec3f low_m{}, high_m{};
    float least_radius2_m2 = 0, highest = 0;
  };

  // The first two sieves; false if nothing of the block passes the first.
  bool screen(std::size_t block, const Vec3f& from, double threshold, std::uint8_t* passes) const;

  std::vector<Source> sources_;
  std::vector<Block> blocks_;
  std::vector<float> x_, y_, z_, radius2_m2_, highest_;
  std::vector<SourceField::Ceiling> ceilings_;
};

}  // namespace clamor
