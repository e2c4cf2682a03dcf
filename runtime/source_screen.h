// source_screen.h: lets only those sources through that could reach a priority at a place.
//
// Three sieves, each cheaper and coarser than the next: the bounding box and highest ceiling of a
// block of neighbours; distance and ceiling of each source, from packed arrays, in vectors; and the
// ceiling towards the place's direction (source_field.h). Sources come in the octree's order, so
// neighbours in number are neighbours in space and in loudness; in any other order the screen is as
// exact and only slower.
//
// Threads: one at a time. Memory: 36 bytes per source.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "common/bands.h"
#include "common/vec.h"
#include "runtime/source_field.h"

namespace clamor {

// A permanent number below this counts as this, for the priority to stay finite.
inline constexpr float kLeastU = 0x1p-32f;

class SourceScreen {
 public:
  // Priority is the sum of bands times weights[signal], over u. `field` must outlive the screen.
  SourceScreen(const SourceField& field, std::span<const Bands> weights, std::span<const float> u);

  // Appends, by ascending number, every source whose priority at `place` is at least `threshold`,
  // and a few more.
  void pass(const Vec3& place, double threshold, std::vector<std::uint32_t>& sources) const;

 private:
  static constexpr std::size_t kBlockSources = 128;

  // Ceilings are over u: of the priority.
  struct Block {
    Vec3f low_m{}, high_m{};
    float least_radius2_m2 = 0, highest = 0;
  };

  void pass_block(std::size_t block, const Vec3& place, double threshold,
                  std::vector<std::uint32_t>& sources) const;

  const SourceField& field_;
  std::vector<Block> blocks_;
  std::vector<float> x_, y_, z_, radius2_m2_, highest_;
  std::vector<SourceField::Ceiling> ceilings_;
};

}  // namespace clamor
