// moving_sources.h: sources that a game adds, moves, retunes and removes while it plays.
//
//   auto car = moving.add({.kind = kEngine, .position_m = {0, 1, -40}, .velocity_mps = {30, 0,
//   0}});
//   ... once a frame of the game, for all that move ...
//   moving.move(*car, position_m, velocity_mps);
//   moving.commit(time_s);
//
// Changes are heard together, from the first keyframe after their commit(). A source is heard
// directly, dimmed by what stands in its way; it leaves no reflections, which are the bake's.
//
// What it sounds like is its kind: a signal, of the bake or one brought along, and a directivity.
// Kinds are named when the auralizer is made; a source may change between them, and then fades
// over. Metres and metres per second; gains are amplitudes at 1 m on its axis playing full scale.
//
// Positions are as of commit's time, in seconds since everything began to play, and velocity
// carries them from there to each keyframe's own moment: so that Doppler is steady though the
// game's frames and keyframes (50 a second) do not fall together. Without a velocity a source
// stays where it was put until it is put elsewhere. After kMaxExtrapolation_s without a commit all
// stand still. A source is heard where it was when its sound left it (position_history.h).
//
// Threads: add, move, retune, remove and commit on one, the caller's; the sampler reads what was
// committed last (three copies, traded by one atomic exchange: newest wins). Neither waits. Memory:
// 1300 bytes a source, taken when it is made. A commit copies all positions: moving 100 000 and
// committing them takes the caller 1 to 4 ms.
#pragma once

#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <string>
#include <vector>

#include "common/bands.h"
#include "common/result.h"
#include "common/vec.h"
#include "formats/level/level.h"

namespace clamor {

inline constexpr std::size_t kMaxMovingSources = 1'000'000;
inline constexpr double kMaxExtrapolation_s = 0.5;

struct MovingKind {
  std::string name;
  std::uint32_t signal = 0;  // of the bake; beyond its last, of MovingOptions::signals
  Bands directivity{};       // as an Emitter's
};

struct MovingOptions {
  std::size_t most = 0;  // at a time; 0: there are none
  std::vector<MovingKind> kinds{};
  std::vector<Signal> signals{};  // that the bake does not have
};

struct MovingSource {
  std::uint32_t kind = 0;
  Vec3 position_m{}, velocity_mps{};
  Vec3 axis{0, 0, -1};
  Bands gain = same_in_all_bands(1);
  // When its signal begins; before now: it has been playing. A loop that begins at 0 or earlier has
  // always been playing. kStartsWhenHeard: its first sample leaves with the first keyframe after
  // the commit, which is what a sound that a game plays now wants: keyframes are made ahead of
  // time.
  double start_s = 0;
};
inline constexpr double kStartsWhenHeard = std::numeric_limits<double>::quiet_NaN();

// Names a source for as long as it is there, and never another one.
struct MovingHandle {
  std::uint32_t place = 0, generation = 0;  // 0: none
};

class MovingSources {
 public:
  MovingSources(std::size_t most, std::size_t kinds);

  // Errors: there are `most` already; a kind that does not exist; a number that is not finite.
  Result<MovingHandle> add(const MovingSource& source);

  // Errors: it was removed; a number that is not finite. Nothing changes then.
  Result<void> move(MovingHandle handle, const Vec3& position_m, const Vec3& velocity_mps = {});
  Result<void> retune(MovingHandle handle, const MovingSource& source);  // all of it
  Result<void> remove(MovingHandle handle);                              // it fades out

  // Makes all of that heard. Without a time, positions are as of the next keyframe.
  void commit(double time_s = kNextKeyframe);
  static constexpr double kNextKeyframe = std::numeric_limits<double>::quiet_NaN();

  std::size_t size() const { return present_; }
  std::size_t most() const { return most_; }

  // ---- The sampler's side --------------------------------------------------------------------

  struct Tune {
    Bands gain{};
    Vec3f axis{};
    std::uint32_t kind = 0;
    std::uint32_t generation = 0;  // of what is heard there: grows with every add and new signal
    std::uint32_t version = 0;     // of this tune
    double start_s = 0;
    bool present = false;
  };
  // By place, up to `count`; positions as columns.
  struct Snapshot {
    std::size_t count = 0;
    double time_s = kNextKeyframe;
    std::uint64_t commits = 0;
    std::vector<float> x_m, y_m, z_m, x_mps, y_mps, z_mps;
    std::vector<Tune> tunes;
  };

  // What was committed last; holds until the next call.
  const Snapshot& latest() noexcept;

 private:
  static constexpr unsigned kSlot = 3, kFresh = 4;

  bool is_present(MovingHandle handle) const;
  void put(std::size_t place, const Vec3& position_m, const Vec3& velocity_mps);
  void tune(std::size_t place, const MovingSource& source);
  void touch(std::size_t place);

  const std::size_t most_, kinds_;
  Snapshot own_;                                     // the caller's, to copy from
  std::vector<std::uint32_t> handles_;               // generations, by place; even: there is none
  std::vector<std::uint32_t> free_;                  // places
  std::array<std::vector<std::uint32_t>, 3> stale_;  // tunes that have changed since, by copy
  std::vector<std::uint8_t> stale_in_;               // the same as bits, by place
  std::size_t present_ = 0;

  std::array<Snapshot, 3> copies_;
  unsigned writing_ = 0;                         // the caller's alone
  alignas(64) std::atomic<unsigned> middle_{1};  // copy, | kFresh until read
  alignas(64) unsigned reading_ = 2;             // the sampler's alone
};

}  // namespace clamor
