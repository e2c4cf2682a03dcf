// moving_sources.h: sources that a game adds, moves, changes and removes while it plays.
//
//   auto car = moving.add({.kind = kEngine, .position_m = {0, 1, -40}, .velocity_mps = {30, 0,
//   0}});
//   ... before each keyframe, for all that move ...
//   moving.move(*car, position_m, velocity_mps);
//   moving.commit(time_s);
//
// Changes take effect together, with a commit() before the next keyframe. A moving source is heard
// directly, with occlusion, and with the reflections of the probes around it (runtime/probes).
//
// A source's kind is its signal, of the bake or brought along, and its directivity. Kinds are named
// when the auralizer is made. A source may change to another kind, and crossfades then. Distances
// are metres and speeds metres per second; gains are amplitudes at 1 m on the axis at full scale.
//
// Positions are as of the commit's time, in seconds since playing began. The velocity extrapolates
// them to each keyframe's own time, so that Doppler is steady although the game's frames and the 50
// keyframes per second do not coincide. Without a velocity a source stays where it was put. After
// kMaxExtrapolation_s without a commit all sources stand still. A source is heard where it was when
// its sound left it (position_history.h).
//
// Threads: the sampler's; applications hand over whole commits (runtime/world).   Memory: 100 bytes
// per source, allocated by the constructor.
#pragma once

#include <cstddef>
#include <cstdint>
#include <limits>
#include <string>
#include <vector>

#include "common/bands.h"
#include "common/result.h"
#include "common/vec.h"
#include "formats/level/signal.h"

namespace clamor {

inline constexpr std::size_t kMaxMovingSources = 1'000'000;
inline constexpr double kMaxExtrapolation_s = 0.5;
inline constexpr double kMaxReverberation = 100;  // 40 dB

struct MovingKind {
  std::string name;
  std::uint32_t signal = 0;  // of the bake, or continuing after them in MovingOptions::signals
  Bands directivity{};       // exponents, as an Emitter's
};

struct MovingOptions {
  std::size_t max_sources = 0;  // at a time
  std::vector<MovingKind> kinds{};
  std::vector<Signal> signals{};  // besides those of the bake
  // Signals that are set and replaced while others play (Auralizer::set_signal()). If there are
  // any, max_sources more kinds follow those above, which Auralizer::set_kind() describes.
  std::size_t signal_slots = 0;
  bool reverberates = true;  // through the probes of the bake, if it has any
};

struct MovingSource {
  std::uint32_t kind = 0;
  Vec3 position_m{}, velocity_mps{};
  Vec3 axis{0, 0, -1};
  Bands gain = same_in_all_bands(1);
  // When the signal begins; a time in the past means that it is playing already, and a loop that
  // begins at 0 or earlier has always been playing. kStartsWhenHeard: the first sample leaves with
  // the first keyframe after the commit, as a game that plays a sound now expects, although
  // keyframes are made ahead of time.
  double start_s = 0;
  std::uint16_t group = 0;  // whose share of the voices may be limited (group_limits.h); 0: none
  // Amplitude of its reflections, which are those of the level's probes (runtime/probes); 0: it is
  // heard directly only.
  float reverberation = 1;
};
inline constexpr double kStartsWhenHeard = std::numeric_limits<double>::quiet_NaN();

// Identifies a source from add() to remove(), and never another one.
struct MovingHandle {
  std::uint32_t slot = 0, generation = 0;  // generation 0: no source
};

class MovingSources {
 public:
  // Positions that are given are in the world's coordinates, those of now() relative to `origin_m`.
  MovingSources(std::size_t max_sources, std::size_t kinds, const Vec3& origin_m = Vec3(0));

  // The slot of the next source that is added, if it can be.
  std::uint32_t next_slot() const;

  // Errors: there are `max_sources` already; no such kind; a number out of range.
  Result<MovingHandle> add(const MovingSource& source);

  // Errors, after which nothing has changed: no such source; a number out of range.
  Result<void> move(MovingHandle handle, const Vec3& position_m, const Vec3& velocity_mps = {});
  Result<void> change(MovingHandle handle, const MovingSource& source);  // all properties
  // The direct sound fades out, and what the source has sounded reverberates until its slot is used
  // again.
  Result<void> remove(MovingHandle handle);

  // Ends a set of changes. Without a time, positions are as of the next keyframe.
  void commit(double time_s = kNextKeyframe);
  static constexpr double kNextKeyframe = std::numeric_limits<double>::quiet_NaN();

  std::size_t size() const { return present_; }
  std::size_t max_sources() const { return max_sources_; }

  // All of a source but its motion.
  struct Settings {
    Bands gain{};
    Vec3f axis{};
    std::uint32_t kind = 0;
    std::uint32_t generation = 0;  // grows with every add and every change of the signal
    std::uint32_t version = 0;     // grows with every change
    double start_s = 0;
    float reverberation = 1;
    std::uint16_t group = 0;
    bool present = false;
  };
  // The first `count` slots; positions as columns.
  struct State {
    std::size_t count = 0;
    double time_s = kNextKeyframe;
    std::uint64_t commits = 0;
    std::vector<float> x_m, y_m, z_m, x_mps, y_mps, z_mps;
    std::vector<Settings> settings;
  };

  const State& now() const { return now_; }

 private:
  bool is_present(MovingHandle handle) const;
  void set_motion(std::size_t slot, const Vec3& position_m, const Vec3& velocity_mps);
  void set(std::size_t slot, const MovingSource& source);
  std::uint32_t take_slot();

  const std::size_t max_sources_, kinds_;
  const Vec3 origin_m_;
  State now_;
  std::vector<std::uint32_t> handles_;  // generations, by slot; even: no source
  // Slots, a ring: the one that has been free for the longest is used first.
  std::vector<std::uint32_t> free_;
  std::size_t first_free_ = 0, free_count_ = 0;
  std::size_t present_ = 0;
};

}  // namespace clamor
