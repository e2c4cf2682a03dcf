// position_history.h: past positions of moving sources, to find where each was when its sound left.
//
// Sound that arrives at x at time t left a source that moves along s at the time t_e with
//
//     c (t - t_e) = |x - s(t_e)|,
//
// which has one solution, because no source is faster than sound. A source that approaches at speed
// v is therefore heard at f / (1 - v / c), while a source that the listener approaches is heard at
// f (1 + v / c).
//
// The history keeps the positions of every keyframe for 0.3 s, of every fourth for 1.6 s, and of
// every sixteenth for 6.7 s. Between them, a path is a cubic Hermite spline. From the position
// where the source was added to the first one kept, the path is a straight line; before that, the
// source moved at its initial velocity. A source that is faster than kMaxSourceMach for one
// keyframe has been teleported, and its history starts anew.
//
// Threads: the sampler's alone.   Memory: 12 bytes per source and row, up to 50 rows, plus 40.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "common/vec.h"

namespace clamor {

// Largest source speed over the speed of sound. At this speed, an approaching source shortens its
// delay by 0.96 frames per frame.
inline constexpr double kMaxSourceMach = 0.49;

class PositionHistory {
 public:
  PositionHistory(std::size_t sources, double speed_of_sound_mps);

  using Column = std::span<const float>;  // by source

  // Stores all positions at a time, replacing those of the same time. A time before the last one
  // clears the history.
  void record(double time_s, Column x_m, Column y_m, Column z_m);

  // Clears one source's history before the newest row, where it moved at this velocity.
  void restart(std::size_t source, const Vec3f& velocity_mps);

  // Sources that the newest row teleported; the caller must restart them.
  std::span<const std::uint32_t> teleported() const { return teleported_; }

  // Whether all sources have been at rest for the whole history, so that emissions are constant.
  bool settled() const;

  struct Emission {
    Vec3f position_m{}, velocity_mps{};
  };
  // The state of a source when the sound left it that reaches `place` at the time of the newest
  // row.
  Emission emission(std::size_t source, const Vec3& place) const;

  // Upper bound, by source, of the square of its distance now over its distance at emission.
  const std::vector<float>& max_distance_ratio2() const { return max_distance_ratio2_; }

 private:
  struct Row {
    double time_s = 0;
    std::uint64_t number = 0;
    std::vector<Vec3f> positions_m;
  };
  struct Origin {
    double time_s = 0;
    Vec3f position_m{}, velocity_mps{};
  };
  struct Knot {
    double time_s = 0;
    Vec3 position_m{};
  };

  // A source's path: its origin is knot 0, and the rows since then are the next knots.
  struct Path {
    std::size_t source = 0, first_row = 0;
  };

  void push(double time_s);
  void thin_out();
  std::size_t last_knot(const Path& path) const { return rows_.size() - path.first_row; }
  Knot knot(const Path& path, std::size_t k) const;
  Vec3 slope(const Path& path, std::size_t k) const;
  Emission emission_before_origin(std::size_t source, const Vec3& place) const;

  const double speed_of_sound_mps_;
  std::vector<Row> rows_, spare_;  // the newest last
  std::uint64_t pushed_ = 0;
  double last_motion_s_ = -1e300;  // when any source moved last
  std::vector<Origin> origins_;
  std::vector<float> max_mach2_, max_distance_ratio2_;
  std::vector<std::uint32_t> teleported_;
};

}  // namespace clamor
