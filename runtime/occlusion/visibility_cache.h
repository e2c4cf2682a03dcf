// visibility_cache.h: what is known of how well sources are heard from where the listener is.
//
// A look at a source costs 10 to 1200 rays, and there are thousands that matter: so each look is
// kept, and holds for the cell it was made in, a ball round where the listener was whose radius is
// a 24th of the distance to the source, 0.1 to 0.4 m; a quarter of that where an edge cuts the
// source, because there it changes the fastest. Outside it is still used, until the source's turn
// comes. There are four depths: a glance says whether the straight line is free (1 ray; 2 at a new
// source), and what that means by its neighbours (occlusion_grid.h); a quick look, 4 ways per ring
// (fresnel_visibility.h), is for one of many; a look, 8 ways, for one that counts alone, being four
// times as loud as the mean; a close look, 64 ways, for one that an edge cuts.
//
// A keyframe may cast so many rays and no more, twice as many where everything changed at once, as
// it does behind a door:
//
//   1. sources that would be chosen and are new get a glance, loudest first, for up to half of the
//      rays;
//   2. then those whose look is no longer good get one again, oldest first, for up to a quarter:
//      that corrects them all within a few keyframes;
//   3. then they get a look, quick ones most of them, by what they count for times how long it is
//      ago; one of each neighbourhood first;
//   4. those that had but a quick look get a whole one, and what is left goes to close looks, each
//      the loudest first.
//
// Of 2 to 4 it thinks for every fourth source at a time (occlusion_upper_bounds.h), the next fourth
// where that leaves nothing to do, and for all of them where everything changed at once.
//
// What goes straight through walls adds to that where a source moves (source_number.h). Where one
// stands still the bake has it: as a source on the far side of the wall.
//
// One that there are no rays left for counts as hidden: it is late, a few keyframes, and weaker
// than all that were looked at.
//
// A render can wait, and needs none of this: an exact cache has no budget, casts no line_tests and
// takes nothing from neighbours. Its sampler asks for looks (estimate_now) at every source that may
// be chosen and was not looked at from within the present cell.
//
// visibility_refresh.cpp has 2 to 4.
//
// The budget is in rays and not in time, so what is heard does not depend on the machine's load.
//
// Threads: the sampler's alone.   Memory: 200 to 280 bytes per source that mattered of late.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "common/bands.h"
#include "common/vec.h"
#include "formats/bake_file/source.h"
#include "runtime/occlusion/occlusion_batch.h"
#include "runtime/occlusion/occlusion_geometry.h"
#include "runtime/occlusion/occlusion_grid.h"
#include "runtime/occlusion/occlusion_upper_bounds.h"

namespace clamor {

inline constexpr int kRaysPerKeyframe = 8000;

struct VisibilityOptions {
  int rays_per_keyframe = kRaysPerKeyframe;
  bool exact = false;  // no budget: every source that matters has a look of the present cell
};

struct VisibilityStatistics {
  std::uint64_t rays = 0, line_tests = 0, looks = 0, fine_estimates = 0;
  double ray_ms = 0;          // of the thread's own time
  std::uint64_t late = 0;     // sources that counted as hidden for want of rays
  std::uint64_t wanted = 0;   // of the last keyframe, sources that mattered,
  std::uint64_t current = 0;  // and those of them whose look was made in this cell
};

// What arrives of a source at `place`, by that many ways per ring (fresnel_visibility.h); nothing
// of one on whose place relative to its walls the file leaves doubts.
Bands source_visibility(const OcclusionGeometry& geometry, double speed_of_sound_mps,
                        const Source& source, const Vec3& place, int paths_per_ring,
                        std::uint64_t& rays);

// Does an edge cut it, so that more rays would tell more?
bool is_partial(const Bands& visibility);

// With as many rays as it takes: for references.
Bands fine_visibility(const OcclusionGeometry& geometry, double speed_of_sound_mps,
                      const Source& source, const Vec3& place);

class VisibilityCache {
 public:
  // A known source, until the next keyframe. It says itself whether anything of it is heard.
  using Index = std::uint32_t;
  static constexpr Index kUnknown = 0xffffffff, kHidden = 0x80000000;

  // What a keyframe would like to know better. `loudness` is its priority as if nothing were in the
  // way; of one that is hidden, which nobody weighs, it may be left out.
  struct Wanted {
    double loudness = 0;
    std::uint64_t number = 0;
    Index index = kUnknown;
    const Source* source = nullptr;
  };

  // The geometry must outlive the cache.
  VisibilityCache(const OcclusionGeometry& geometry, double speed_of_sound_mps,
                  const VisibilityOptions& options);

  bool exact() const { return options_.exact; }

  // The listener's place for what follows, and new rays to cast.
  void begin_keyframe(const Vec3& place);

  // Fetches what find() will want of a source, a little later.
  void prefetch(std::uint64_t number) const;
  Index find(std::uint64_t number) const;
  static bool is_hidden(Index known) { return (known & kHidden) != 0; }

  // The same of one whose look was made in this cell; kUnknown if there is none.
  Index find_current(std::uint64_t number, const Source& source);

  // What arrives of a known source; and, a little earlier, that it will be asked for.
  const Bands& visibility(Index known) const { return entries_[known & ~kHidden].visibility; }
  void prefetch_visibility(Index known) const {
    __builtin_prefetch(&entries_[known & ~kHidden].visibility);
  }

  // Those of which nothing is heard, and that need not be asked about in this keyframe.
  const OcclusionUpperBounds& hidden() const { return hidden_; }

  // Looks at an unknown source; kUnknown if there are no rays left for that.
  Index look(std::uint64_t number, const Source& source, double loudness);

  // A look from here, whatever it costs, unless one from this cell is known: for those who take
  // every source.
  const Bands& estimate_now(std::uint64_t number, const Source& source);

  // The same for many, on all cores: what is visible of each, in their order.
  std::vector<Bands> estimate_now(std::span<const Wanted> sources);

  // Spends what is left of the rays on those that are as loud as `tau`, a quarter of them at a
  // time; false if nothing was left to be done.
  bool refresh(std::span<const Wanted> wanted, double tau);

  const VisibilityStatistics& statistics() const { return statistics_; }

 private:
  enum class Depth : std::uint8_t { kGlance, kQuick, kLook, kClose };
  // What is asked of those whose turn it is lies in one line of memory.
  struct alignas(64) Entry {
    std::uint64_t number = 0;
    Vec3f from_m{};  // where the listener was, at the last glance or look
    float cell_m = 0;
    Vec3f start_m{};         // where rays leave the source
    float reach = 0;         // its loudness as if nothing were in the way, at 1 m
    float change_clock = 0;  // of the neighbourhood's clock
    std::uint32_t changed = 0, looked = 0, used = 0;  // keyframes
    Depth depth = Depth::kGlance;
    bool has_start = false, straight = false, hidden = false;
    std::uint8_t step = OcclusionUpperBounds::kHeard;
    Bands around{};      // what gets past what is in the way
    Bands visibility{};  // with what goes through it
  };
  struct Slot {
    std::uint64_t number = 0;
    Index index = kUnknown;  // of the entry, | kHidden if it is; kUnknown: the slot is free
  };
  // One of those that refresh() is about.
  struct Turn {
    double urgency;
    Index index;
    const Source* source;
    bool counts_alone = true;  // and not only as one of many
  };

  bool is_within(const Entry& entry, const Source& source, double cells) const;
  bool is_current(const Entry& entry, const Source& source) const;
  Index add(std::uint64_t number, const Source& source);
  void make_room();
  Slot& slot_of(std::uint64_t number);  // or the free one where it would be
  void follow(Entry& entry, const Source& source);
  void seen(Entry& entry, const Source& source);
  void glance_at(Entry& entry, const Source& source);
  void look_at(Entry& entry, const Source& source, Depth depth);
  void looked(Entry& entry, const Source& source, Depth depth, const VisibilityEstimate& look);
  void believe_neighbours(Entry& entry, const Source& source, bool new_side);
  bool everything_changed() const { return cells_.change_clock() > last_change_clock_ + 0.5; }
  void gather(std::span<const Wanted> wanted, double tau, std::uint32_t turn, bool all);
  void glance_again(std::vector<Turn>& turns);
  void serve(std::vector<Turn>& turns, Depth depth);

  const OcclusionGeometry& geometry_;
  const double speed_of_sound_mps_;
  const VisibilityOptions options_;
  std::vector<Slot> slots_;  // open addressing, a power of two
  std::vector<Entry> entries_;
  OcclusionUpperBounds hidden_;
  OcclusionGrid cells_;
  std::vector<std::uint32_t> in_turn_;  // of those wanted
  std::vector<Turn> turns_, look_turns_, close_turns_;
  Vec3 place_{};
  double mean_weight_ = 0;                       // of those that matter
  double surprise_ = 0, last_change_clock_ = 0;  // of the looks of a keyframe, summed
  std::uint32_t keyframe_ = 0;
  std::uint32_t idle_ = 0;  // turns in which nothing was left to do, here
  int expected_ = 0;        // those that there were expectations of
  std::int64_t rays_left_ = 0;
  VisibilityStatistics statistics_;
};

}  // namespace clamor
