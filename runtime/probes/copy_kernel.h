// copy_kernel.h: which copies of a first reflection can reach a priority at the listener's place?
//
// A first reflection is a secondary source on the first surface of its path from a probe. Moving
// sources near by are heard with copies of it, each with the power and the mirror direction of the
// moving source's own place (probe_sources.h). Their upper bounds are evaluated 16 copies at a
// time. A single bound that holds for all of them, in every direction, is too high: with 1000
// moving sources in the violin room it found 750 copies for each that reached the threshold, and
// keyframes ended with a tenth of their voices.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "common/vec.h"
#include "runtime/propagation/source_bound.h"

namespace clamor {

// The places of copies, in metres from their probe, and the factors of their upper bounds, as
// structure of arrays. The copies of a probe lie by descending factor.
struct CopyRows {
  std::vector<float> x_m, y_m, z_m, factor;

  void clear();
  void add(const Vec3& from_probe_m, float of_bounds);
  // Makes room to read a vector beyond the last copy.
  void pad();
};

// A first reflection, and what is asked of its copies. Positions are relative to the probe, in
// metres. `bound` is that of the reflection for a source at the probe, in any direction of
// incidence.
struct FirstReflection {
  SourceBound bound;
  Vec3f listener_m{};
  float irradiance_of_probe = 0;  // at the reflection (probe_sources.h)
  float threshold = 0;
};

// The copies that were found, ascending, with the upper bounds of their priorities.
struct ReachingCopies {
  std::size_t count = 0;
  std::vector<std::uint32_t> index;  // padded by one vector
  std::vector<float> upper_bound;

  // Removes all, and makes room for so many.
  void make_room(std::size_t max_count);
};

// Finds every one of the copies `first` to `first + count` whose priority may reach the threshold.
void find_reaching_copies(const FirstReflection& reflection, const CopyRows& copies,
                          std::size_t first, std::size_t count, ReachingCopies& reaching);

}  // namespace clamor
