// decay_curve.h: Schroeder's backward integral of an energy response, and its decay times.
//
// The curve at time t is the energy that arrives later, in decibels of the total: a staircase that
// falls at each arrival. Decay times are least-squares lines through a range of it (ISO 3382-1),
// extrapolated to 60 dB. The fit integrates the staircase exactly, so it needs no time grid and
// works alike for ten arrivals and for a million samples.
//
// M. R. Schroeder. New Method of Measuring Reverberation Time. J. Acoust. Soc. Am. 37, 1965.
#pragma once

#include <optional>
#include <span>
#include <vector>

namespace clamor {

// Energy (at least 0) that arrives `time_s` after the direct sound. Negative times count as 0.
struct EnergyStep {
  double time_s = 0;
  double energy = 0;
};

class DecayCurve {
 public:
  // Steps are in ascending order of time. The response ends `end_s` after the direct sound.
  DecayCurve(const std::vector<EnergyStep>& steps, double end_s);

  double energy() const { return energy_; }

  // Energy that arrives after `time_s`, in decibels of the total; -1e9 if there is none.
  double level_db(double time_s) const;

  // Seconds to fall by 60 dB at the slope of the line from from_db to to_db (0, -10: EDT; -5, -25:
  // T20; -5, -35: T30). None where the response does not support a fit:
  //
  // * the energy of its last tenth lies less than 10 dB below to_db, so truncation or the noise
  //   floor bends the curve;
  // * fewer than 8 arrivals lie in the range, which then shows single echoes.
  std::optional<double> decay_time_s(double from_db, double to_db) const;

  // Early decay time, fitted from 0 to -10 dB. The direct sound alone may cause most of that fall,
  // and the remainder then says nothing about decay. So the result is none if the fitted line falls
  // by less than half of the range while the curve falls by all of it, or if fewer than 8 treads of
  // the range have a duration.
  std::optional<double> early_decay_time_s() const;

 private:
  struct Tread {  // curve between two arrivals
    double start_s, end_s, level_db;
  };

  std::span<const Tread> range(double from_db, double to_db) const;

  std::vector<Tread> treads_;
  double energy_ = 0;
  double end_db_ = 0;  // level of the last tenth of the response
};

}  // namespace clamor
