// hrtf_phase_fit.h: fits phases at the quadrature nodes to interaural phase differences in ERB
// bands.
//
// A band that leads by p at one ear and lags by p at the other has gain cos p in the band and sin p
// in its quadrature. Summed over an ERB band, the spectrum of one ear times the conjugate of the
// other's is u' M_b v*, where M_b holds the products of bands and quadratures over its frequencies.
// Its argument is the interaural phase difference. Solved by Gauss-Newton with errors in units of
// each band's tolerance, weights growing where the error is largest, and slight damping, since
// there are fewer nodes than bands. In double precision.
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

  using Phases = std::array<double, kHrtfQuadratures>;  // of the left ear at the nodes, radians

  using Wanted = std::array<InterauralTimes::Phase, kPhaseBands>;

  // `levels` are the gains of both ears before rotation. In the high layer, which has its own
  // delay, the left ear leads by `high_phase` at the frequency where the layers meet.
  Phases phases_for(const std::array<HrtfGains, kEars>& levels, const Wanted& wanted,
                    double high_phase) const;

  // The largest error of a band, in units of its tolerance.
  double largest_miss(const std::array<HrtfGains, kEars>& levels, const Phases& phases,
                      const Wanted& wanted, double high_phase) const;

  // Replaces `forms` of hrtf_magnitude_fit.h by those of the rotated bands.
  void turn(const Phases& phases, double high_phase, HrtfMagnitudeFit::Forms& forms) const;

  // In-phase and quadrature gains of an ear.
  static HrtfGains in_phase(const HrtfGains& levels, const Phases& phases);
  static QuadratureGains across(const HrtfGains& levels, const Phases& phases, std::size_t ear);

 private:
  static Phases first_guess(const Wanted& wanted);
  static std::array<double, kHrtfLowBands> at_bands(const Phases& phases);
  // ERB bands in which the low layer is audible, and high bands that are audible in them.
  static constexpr std::size_t kBandsHere = kPhaseBands + 2, kHighHere = 6;
  static constexpr std::size_t kHere = kHrtfLowBands + kHighHere;
  // Low bands, quadratures, high bands.
  static constexpr std::size_t kParts = kHrtfLowRows + kHighHere;
  struct Form {
    std::vector<std::size_t> parts;  // audible in the band
    std::vector<double> products;    // [part][part]
    // Centre frequency relative to the frequency where the layers meet.
    double share_of_parting = 0;
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
