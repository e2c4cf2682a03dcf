// position_history.h: where moving sources have been, to know where each was when sound left it.
//
// Sound that arrives at x at time t left a source that moves along s at the time t_e with
//
//     c (t - t_e) = |x - s(t_e)|,
//
// once, since nothing here is as fast as sound. So a source that comes nearer at speed v is heard
// at f / (1 - v / c), where one whose listener comes nearer is heard at f (1 + v / c).
//
// Positions are kept of each keyframe for 0.3 s, of every fourth for 1.6 s, and of every sixteenth
// for 6.7 s; between them a path is a cubic through its neighbours' slopes, and from where the
// source was added to the first that is kept it is a straight line. Before that the source moved as
// it did when it was added. A source that is faster than kMaxSourceMach for a keyframe was put
// elsewhere: what is known of it begins anew.
//
// Threads: the sampler's alone.   Memory: 12 bytes a source and row, up to 50 rows, and 40 more.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "common/vec.h"

namespace clamor {

// In speeds of sound. A source that comes nearer so fast shortens its delay by 0.96 frames a frame.
inline constexpr double kMaxSourceMach = 0.49;

class PositionHistory {
 public:
  PositionHistory(std::size_t sources, double speed_of_sound_mps);

  using Column = std::span<const float>;  // by source

  // Where all are at a time: the newest row, or it again. A time before the last forgets all rows.
  void record(double time_s, Column x_m, Column y_m, Column z_m);

  // Nothing is known of a source before the newest row but that it moved like this.
  void restart(std::size_t source, const Vec3f& velocity_mps);

  // Sources that were put elsewhere by the newest row; they have to be restarted.
  std::span<const std::uint32_t> jumped() const { return jumped_; }

  // Whether all have been at rest for so long that this is what is heard of them.
  bool settled() const;

  struct Emission {
    Vec3f position_m{}, velocity_mps{};
  };
  // The state of a source at the time when the sound left it that reaches `place` with the newest
  // row.
  Emission emission(std::size_t source, const Vec3& place) const;

  // The distance to where a source is now over the distance at emission is at most this.
  const std::vector<float>& nearer() const { return nearer_; }

 private:
  struct Row {
    double time_s = 0;
    std::uint64_t number = 0;
    std::vector<Vec3f> at_m;
  };
  struct Origin {
    double time_s = 0;
    Vec3f position_m{}, velocity_mps{};
  };
  struct Knot {
    double time_s = 0;
    Vec3 position_m{};
  };

  // The known way of a source: where it began, and the rows since.
  struct Way {
    std::size_t source = 0, first_row = 0;
  };

  void push(double time_s);
  void thin_out();
  std::size_t last_knot(const Way& way) const { return rows_.size() - way.first_row; }
  Knot knot(const Way& way, std::size_t k) const;
  Vec3 slope(const Way& way, std::size_t k) const;
  Emission before_all(std::size_t source, const Vec3& place) const;

  const double speed_of_sound_mps_;
  std::vector<Row> rows_, spare_;  // the newest last
  std::uint64_t pushed_ = 0;
  double last_step_s_ = -1e300;  // when a source moved last
  std::vector<Origin> origins_;
  std::vector<float> fastest2_, nearer_;  // squares of speeds of sound
  std::vector<std::uint32_t> jumped_;
};

}  // namespace clamor
