// hrtf_phase_fit.h: finds the phases at the nodes of a head's quadratures that have given phases
// between the ears in ERB bands.
//
// A sound that is ahead by p in one ear's band, and as far behind in the other's, is level cos p in
// the band and level sin p in its quadrature. Summed over an ERB band, the spectrum of one ear
// times the conjugate of the other's is u' M_b v*, M_b being the bands' and quadratures' products
// over its frequencies; its argument is the phase between the ears. By Gauss and Newton, each
// band's miss in units of what it may be, weights growing where most is missing; with a little
// damping, since there are fewer nodes than bands to tell them. In double.
#pragma once

#include <array>
#include <complex>
#include <cstddef>
#include <vector>

#include "runtime/hrtf/hrtf_filter_bank.h"
#include "runtime/hrtf/hrtf_magnitude_fit.h"
#include "runtime/hrtf/interaural_times.h"

namespace clamor {

class HrtfPhaseFit {
 public:
  HrtfPhaseFit();

  using Phases = std::array<double, kHrtfQuadratures>;  // of the left ear, at the nodes, radians

  using Wanted = std::array<InterauralTimes::Phase, kPhaseBands>;

  // `levels` of both ears before they are turned. In the high layer, whose delay is its own, the
  // left ear is ahead by `high_phase` where the layers part.
  Phases phases_for(const std::array<HrtfGains, kEars>& levels, const Wanted& wanted,
                    double high_phase) const;

  // By which most of a band's phase is missed, as a share of what it may be.
  double largest_miss(const std::array<HrtfGains, kEars>& levels, const Phases& phases,
                      const Wanted& wanted, double high_phase) const;

  // Makes `forms` of a hrtf_magnitude_fit.h those of bands that are so turned.
  void turn(const Phases& phases, double high_phase, HrtfMagnitudeFit::Forms& forms) const;

  // Levels as they are in phase, and those of the quadratures of an ear.
  static HrtfGains in_phase(const HrtfGains& levels, const Phases& phases);
  static QuadratureGains across(const HrtfGains& levels, const Phases& phases, std::size_t ear);

 private:
  static Phases first_guess(const Wanted& wanted);
  static std::array<double, kHrtfLowBands> at_bands(const Phases& phases);
  // ERB bands in which the low layer is heard, and bands of the high one that are heard in these.
  static constexpr std::size_t kBandsHere = kPhaseBands + 2, kHighHere = 6;
  static constexpr std::size_t kHere = kHrtfLowBands + kHighHere;
  static constexpr std::size_t kParts = kHrtfLowRows + kHighHere;  // low bands, quadratures, high
  struct Form {
    std::vector<std::size_t> parts;  // that are heard in the band
    std::vector<double> products;    // [part][part]
    double share_of_parting = 0;     // its centre, of the frequency where the layers part
  };
  using Ear = std::array<std::complex<double>, kParts>;
  using Misses = std::array<double, kPhaseBands>;

  static Ear ear_of(const HrtfGains& levels, const Phases& phases, std::size_t ear);
  std::complex<double> sum_over(std::size_t band, const Ear& one, const Ear& other,
                                double one_phase, double other_phase) const;
  Misses misses(const std::array<HrtfGains, kEars>& levels, const Phases& phases, double high_phase,
                const Wanted& wanted) const;

  std::array<Form, kBandsHere> forms_;
};

}  // namespace clamor
