// first_reflection_kernel.h: finds the first reflections of a moving source that can reach a
// priority at the listener's place.
//
// First reflections were traced from a place near the source's (first_reflections.h), and have the
// power and the mirror direction of its own place (probe_sources.h). Their upper bounds are
// evaluated 16 at a time. Bounds that hold for all places near by, in every direction, are too
// high: with 1000 moving sources in the violin room they found 750 reflections for each that
// reached the threshold.
#pragma once

#include <cstddef>
#include <vector>

#include "common/vec.h"
#include "runtime/probes/probe_sources.h"
#include "runtime/propagation/source_page.h"

namespace clamor {

// First reflections traced from one place, as structure of arrays. Positions are relative to that
// place, in metres.
class FirstReflectionRows {
 public:
  struct Block : CullBlock {
    Row irradiance{};  // at the reflection, of a source at the place (probe_sources.h)
    Row side{};        // -1: sound arrives against the normal, 1: along it, being transmitted
  };

  void clear();
  // Adds a reflection of sound that left `place_m`, with its bound for any direction of incidence.
  void add(const ProbeBounds& bounds, Source reflection, const Vec3& place_m);

  std::size_t size() const { return size_; }
  float reach_m() const { return reach_m_; }  // distance of the farthest reflection
  // Upper bound of all priorities for a listener there, relative to the place.
  float upper_bound(const Vec3f& listener_m) const;
  const std::vector<Block>& blocks() const { return blocks_; }
  BandMix mix(std::size_t index) const {
    return blocks_[index / kCullBlock].mix[index % kCullBlock];
  }

 private:
  std::vector<Block> blocks_;
  std::size_t size_ = 0;
  float reach_m_ = 0;
  Vec3f low_m_{}, high_m_{};             // box around all reflections
  float min_radius2_m2_ = 0, peak_ = 0;  // the highest bound at 1 m
};

// Positions are relative to the place that the reflections were traced from, in metres.
struct FirstReflectionQuery {
  Vec3f source_m{}, listener_m{};
  float threshold = 0;
};

// Finds every reflection whose priority may reach the threshold.
void find_reaching_reflections(const FirstReflectionRows& rows, const FirstReflectionQuery& query,
                               CulledPage& reaching);

}  // namespace clamor
