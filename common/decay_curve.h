// decay_curve.h: Schroeder's backward integral of a response, and the decay times it shows.
//
// The curve at time t is the energy that has yet to come, in decibels of the whole: a staircase
// that falls at each arrival. Decay times are least-squares lines through a range of it, as ISO
// 3382-1 asks, extrapolated to 60 dB. The fit is an exact integral over the staircase, so it needs
// no time grid and is the same for ten arrivals as for a million samples.
//
// M. R. Schroeder. New Method of Measuring Reverberation Time. J. Acoust. Soc. Am. 37, 1965.
#pragma once

#include <optional>
#include <span>
#include <vector>

namespace clamor {

// Energy `energy` (0 or more) that arrives `time_s` after the direct sound; before counts as with
// it.
struct EnergyStep {
  double time_s = 0;
  double energy = 0;
};

class DecayCurve {
 public:
  // Steps by ascending time. The response ends `end_s` after the direct sound.
  DecayCurve(const std::vector<EnergyStep>& steps, double end_s);

  double energy() const { return energy_; }

  // Decibels of the whole that have yet to come at a time; -1e9 where nothing does.
  double level_db(double time_s) const;

  // Seconds to fall by 60 dB at the slope of the line through from_db ... to_db (0, -10: EDT; -5,
  // -25: T20; -5, -35: T30). Nothing where the response is too short to tell:
  //
  // * when the energy of its last tenth lies less than 10 dB below to_db. What was cut off, or the
  //   noise that it ends in, would then bend the curve;
  // * when fewer than 8 arrivals lie in the range: then it shows echoes, not a decay.
  std::optional<double> decay_time_s(double from_db, double to_db) const;

  // EDT: the same for 0 ... -10 dB, where the direct sound may make most of the fall at one moment.
  // A line through what is left of the range tells nothing of a decay, so there is none where it
  // falls by less than half of the range in the time in which the curve falls by all of it, or
  // where fewer than 8 treads of the range take any time.
  std::optional<double> early_decay_time_s() const;

 private:
  struct Tread {  // the curve between one arrival and the next
    double start_s, end_s, level_db;
  };

  std::span<const Tread> range(double from_db, double to_db) const;

  std::vector<Tread> treads_;
  double energy_ = 0;
  double end_db_ = 0;  // the last tenth of the response
};

}  // namespace clamor
