// source_page.h: sources that are neighbours, laid out for choosing among them.
//
// Lets only those through that could reach a priority at a place, by ceilings of distance and
// direction (source_culler.h). In any order of the sources it is as exact, and only slower.
//
// Immutable once made. Memory: 170 bytes per source. Not in huge pages (madvise): with ten million
// sources they make a keyframe 5 % quicker besides its rays and first loading a fifth slower.
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

// A permanent number below this counts as this, for the priority to stay finite.
inline constexpr float kMinU = 0x1p-64f;

// Of the priority of a source, as the sieve has it, late ones boosted in full (late_boost.h);
// `weight` is that of its signal.
CullSource cull_source(const RadiationModel& field, const Bands& weight, const Source& source);

class SourcePage {
 public:
  // Priority is the sum of bands times weights[signal], boosted, over u.
  SourcePage(const RadiationModel& field, std::span<const Bands> weights,
             std::vector<Source> sources);

  std::size_t size() const { return sources_.size(); }
  const Source& operator[](std::size_t index) const { return sources_[index]; }
  std::size_t bytes() const { return bytes_; }  // of memory

  const Source* data() const { return sources_.data(); }

  // What pass() reads first; and, a little earlier, what leads there.
  void prefetch_cullers() const {
    prefetch_to_read(cullers_.data(), cullers_.size() * sizeof(SourceCuller));
  }
  void prefetch() const {
    for (const SourceCuller& sieve : cullers_) sieve.prefetch();
  }
  void prefetch(std::size_t index) const { prefetch(sources_[index]); }
  static void prefetch(const Source& source) {
    __builtin_prefetch(&source);
    __builtin_prefetch(&source + 1);  // it lies across two lines
  }

  // Calls found(index, ceiling), ascending, for every source whose priority at `place` is at least
  // `threshold`, and for a few more; `ceiling` is one of the priority. A `found` that takes
  // its CullRecord as well may do without touching the source. Gives how many sources were
  // looked at one by one.
  template <class Found>
  std::size_t pass(const Vec3& place, double threshold, const Found& found,
                   const CullMargin& give = CullMargin()) const {
    CullResult sifted;
    std::size_t looked_at = 0;
    for (std::size_t s = 0; s < cullers_.size(); ++s) {
      cullers_[s].sift(place, threshold, sifted, give);
      looked_at += sifted.looked_at;
      const std::size_t first = s * kCullerSources;
      if constexpr (std::is_invocable_v<Found, std::size_t, double, const CullRecord&>) {
        sifted.for_each([&](std::size_t i, double ceiling) {
          found(first + i, ceiling, cullers_[s].part(sifted.slot[i]));
        });
      } else {
        // They are far apart in memory, and all of them are about to be read.
        sifted.for_each([&](std::size_t i, double) { prefetch(first + i); });
        sifted.for_each([&](std::size_t i, double ceiling) { found(first + i, ceiling); });
      }
    }
    return looked_at;
  }

 private:
  std::vector<Source> sources_;
  std::vector<SourceCuller> cullers_;
  std::size_t bytes_ = 0;
};

}  // namespace clamor
