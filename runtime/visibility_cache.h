// visibility_cache.h: what is known of how well sources are heard from where the listener is.
//
// A look at a source costs 50 to 1200 rays, and there are thousands that matter: so each look is
// kept, and holds for the cell it was made in, a ball round where the listener was whose radius is
// a twelfth of the distance to the source, 0.15 to 0.75 m. Outside it is still used, until the
// source's turn comes. A keyframe may cast so many rays and no more:
//
//   1. sources that would be chosen and were never looked at get a glance, the straight line alone
//      (2 rays), loudest first, for up to half of the rays;
//   2. of the rest, three quarters go to the loudest whose look is no longer or not yet good
//      enough, one quarter to those that have waited the longest, so that none waits for ever;
//   3. what is left goes to close looks at those that edges cut.
//
// One that there are no rays left for counts as hidden: it is late, a few keyframes, and weaker
// than all that were looked at. When told to be exact (a render, which can wait), there are as many
// rays for looks at unknown sources as it takes, and no glances.
//
// The budget is in rays and not in time, so what is heard does not depend on the machine's load.
//
// Threads: the sampler's alone.   Memory: 160 to 320 bytes per source that mattered of late.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "common/bands.h"
#include "common/vec.h"
#include "formats/source.h"
#include "runtime/sight_geometry.h"

namespace clamor {

inline constexpr int kRaysPerKeyframe = 16'000;

struct VisibilityOptions {
  int rays_per_keyframe = kRaysPerKeyframe;
  bool exact = false;  // look at every unknown source as long as it takes
};

struct VisibilityStatistics {
  std::uint64_t rays = 0, glances = 0, looks = 0, close_looks = 0;
  double casting_ms = 0;
  std::uint64_t late = 0;     // sources that counted as hidden for want of rays
  std::uint64_t wanted = 0;   // of the last keyframe, sources that mattered,
  std::uint64_t current = 0;  // and those of them whose look was made in this cell
};

// What arrives of a source at `place`, by that many ways per ring (fresnel_visibility.h); nothing
// of one on whose place relative to its walls the file leaves doubts.
Bands source_visibility(const SightGeometry& geometry, double speed_of_sound_mps,
                        const Source& source, const Vec3& place, int ways_per_ring,
                        std::uint64_t& rays);

// Does an edge cut it, so that more rays would tell more?
bool is_partial(const Bands& visibility);

// With as many rays as it takes: for references.
Bands look_closely(const SightGeometry& geometry, double speed_of_sound_mps, const Source& source,
                   const Vec3& place);

class VisibilityCache {
 public:
  // What a keyframe would like to know better.
  struct Wanted {
    double loudness = 0;
    std::uint64_t number = 0;
    const Source* source = nullptr;
  };

  // The geometry must outlive the cache.
  VisibilityCache(const SightGeometry& geometry, double speed_of_sound_mps,
                  const VisibilityOptions& options);

  bool exact() const { return options_.exact; }

  // The listener's place for what follows, and new rays to cast.
  void begin_keyframe(const Vec3& place);

  // What is known of the source, null if nothing. Valid until the next look.
  struct Known {
    Bands visibility{};
    float loudness = 0;   // as it was when it was looked at
    bool hidden = false;  // in all bands
  };
  const Known* known(std::uint64_t number);

  // Looks at an unknown source; null if there are no rays left for that.
  const Known* look(std::uint64_t number, const Source& source, double loudness);

  // A look from here, whatever it costs, unless one from this cell is known: for those who take
  // every source.
  const Bands& look_now(std::uint64_t number, const Source& source);

  // Spends what is left of the rays; false if nothing was left to be done. Reorders `wanted`.
  bool refresh(std::span<Wanted> wanted);

  const VisibilityStatistics& statistics() const { return statistics_; }

 private:
  enum class Depth : std::uint8_t { kNone, kGlance, kLook, kClose };
  struct Entry {
    std::uint64_t number = 0;
    Vec3f from_m{};  // where the listener was
    float cell_m = 0;
    std::uint32_t looked = 0, used = 0;  // keyframes
    Depth depth = Depth::kNone;          // kNone: the slot is free
    Known known;
  };

  bool is_current(const Entry& entry) const;
  Entry* find(std::uint64_t number);
  Entry& find_or_add(std::uint64_t number);
  void grow();
  void look_at(Entry& entry, const Source& source, Depth depth);

  const SightGeometry& geometry_;
  const double speed_of_sound_mps_;
  const VisibilityOptions options_;
  std::vector<Entry> table_;  // open addressing, a power of two
  std::size_t entries_ = 0;
  Vec3 place_{};
  std::uint32_t keyframe_ = 0;
  std::int64_t rays_left_ = 0;
  VisibilityStatistics statistics_;
};

}  // namespace clamor
