// source_mirrors.h: the mirrors that a moving source sees, which give it image sources.
//
// The rays of a source's first reflections (first_reflection_tracer.h) find the planes of its
// mirrors. Its image in such a plane follows the source exactly (formats/bake_file/image_source.h),
// and the paths of the listener's rays decide where it is heard (runtime/occlusion/image_path.h).
// Mirrors with only one ray are facets of curved surfaces or far away and small: their whole
// reflection stays with the traced ones.
//
// Threads: the sampler's alone.   Memory: 96 bytes per mirror.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <vector>

#include "common/vec.h"
#include "runtime/occlusion/mirror_plane.h"
#include "runtime/probes/first_reflection_tracer.h"

namespace clamor {

class SourceMirrors {
 public:
  static constexpr std::size_t kSets = FirstReflectionTracer::kSets;
  static constexpr std::uint32_t kNone = std::numeric_limits<std::uint32_t>::max();

  struct Mirror {
    MirrorPlane plane;                // its normal is towards the source
    float reflected = 0;              // share of the power, in the loudest band
    float u = 1;                      // permanent random number of its image
    std::uint32_t number = 0;         // identifies it for as long as rays find it
    std::array<float, kSets> rays{};  // of each set, that it reflects; none: there is no mirror
    bool makes_image = false;
  };

  // Forgets all. `key` selects the random numbers of new mirrors.
  void clear(std::uint64_t key);

  // Replaces what a set of rays from `place_m` has found: begin_set(), then add() for each ray that
  // a mirror reflects, which returns the mirror's index, then end_set(). The first `traced` sets
  // stand for all.
  void begin_set(std::size_t set);
  std::uint32_t add(std::size_t set, const Vec3& place_m, const MirrorPlane& plane, float reflected,
                    float rays);
  void end_set(std::size_t traced);

  // Whether the mirror with this index makes an image source. kNone makes none.
  bool makes_image(std::uint32_t index) const {
    return index != kNone && mirrors_[index].makes_image;
  }

  const std::vector<Mirror>& all() const { return mirrors_; }

 private:
  std::uint32_t insert(const MirrorPlane& plane);

  std::vector<Mirror> mirrors_;  // their indices stay; free ones are used again
  std::uint32_t next_number_ = 0;
  std::uint64_t key_ = 0;
};

}  // namespace clamor
