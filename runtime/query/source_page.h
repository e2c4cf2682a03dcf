// source_page.h: sources that are neighbours, laid out for culling (source_culler.h).
//
// Culling is exact for any order of the sources, and fastest by descending key.
//
// Immutable once made.   Memory: 166 bytes per source. Huge pages (madvise) make a keyframe 5 %
// faster besides its rays, with ten million sources, and first loading a fifth slower: not worth
// it.
#pragma once

#include <cstddef>
#include <span>
#include <type_traits>
#include <vector>

#include "common/bands.h"
#include "common/vec.h"
#include "runtime/propagation/radiation_model.h"
#include "runtime/query/source_culler.h"

namespace clamor {

// Smaller permanent numbers count as this, so that priorities stay finite.
inline constexpr float kMinU = 0x1p-64f;

// What the culler needs to bound the priority of a source with the full late boost (late_boost.h);
// `weight` is that of its signal.
CullSource cull_source(const RadiationModel& field, const Bands& weight, const Source& source);

class SourcePage {
 public:
  // The priority is the sum of bands times weights[signal], boosted, over u.
  SourcePage(const RadiationModel& field, std::span<const Bands> weights,
             std::vector<Source> sources);

  std::size_t size() const { return sources_.size(); }
  const Source& operator[](std::size_t index) const { return sources_[index]; }
  std::size_t bytes() const { return bytes_; }

  const Source* data() const { return sources_.data(); }

  // Prefetches what cull() reads first; and, a little earlier, what points there.
  void prefetch_cullers() const {
    prefetch_to_read(cullers_.data(), cullers_.size() * sizeof(SourceCuller));
  }
  void prefetch() const {
    for (const SourceCuller& sieve : cullers_) sieve.prefetch();
  }
  void prefetch(std::size_t index) const { prefetch(sources_[index]); }
  static void prefetch(const Source& source) {
    __builtin_prefetch(&source);
    __builtin_prefetch(&source + 1);  // a source lies across two cache lines
  }

  // Calls found(index, upper bound[, CullRecord]), ascending, for every source whose priority at
  // `place` is at least `threshold`, and for a few more. Without the record the sources themselves
  // are prefetched. Returns how many sources were tested one by one.
  template <class Found>
  std::size_t cull(const Vec3& place, double threshold, const Found& found,
                   const CullMargin& margin = CullMargin()) const {
    CullResult result;
    std::size_t tested = 0;
    for (std::size_t s = 0; s < cullers_.size(); ++s) {
      cullers_[s].cull(place, threshold, result, margin);
      tested += result.tested;
      const std::size_t first = s * kCullerSources;
      if constexpr (std::is_invocable_v<Found, std::size_t, double, const CullRecord&>) {
        result.for_each([&](std::size_t i, double upper_bound) {
          found(first + i, upper_bound, cullers_[s].record(i));
        });
      } else {
        // The sources are far apart in memory, and all of them are about to be read.
        result.for_each([&](std::size_t i, double) { prefetch(first + i); });
        result.for_each([&](std::size_t i, double upper_bound) { found(first + i, upper_bound); });
      }
    }
    return tested;
  }

 private:
  std::vector<Source> sources_;
  std::vector<SourceCuller> cullers_;
  std::size_t bytes_ = 0;
};

}  // namespace clamor
