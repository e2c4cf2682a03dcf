// hrtf_magnitude_fit.h: fits band gains of the HRTF filter bank to energies in ERB bands.
//
//     E_b(a) = mean over the frequencies of ERB band b of (sum over j of a_j B_j(f))^2 = a' Q_b a,
//
// so only the matrices Q_b are needed, which are a few neighbours wide. (Bands with different
// phases, as in hrtf_phase_fit.h, have other Q_b.) Minimises the sum over b of w_b (ln E_b(a) - ln
// E_b)^2, with weights growing where the error is largest, and keeps the gains with the smallest
// maximum error. In double precision.
#pragma once

#include <array>
#include <cstddef>
#include <vector>

#include "runtime/hrtf/erb_bands.h"
#include "runtime/hrtf/hrtf_filter_bank.h"

namespace clamor {

class HrtfMagnitudeFit {
 public:
  HrtfMagnitudeFit();

  struct Form {
    std::size_t first = 0, end = 0;  // bands audible in this ERB band
    std::array<std::array<double, kHrtfBands>, kHrtfBands> q{};
  };
  using Forms = std::vector<Form>;  // by ERB band
  const Forms& forms() const { return forms_; }

  // All energies must be above 0.
  HrtfGains levels_for(const ErbBands& energy, const Forms& forms) const;

  // Octave gains, as the octave buses apply them, that give each octave the mean energy of its ERB
  // bands. The first and the last octave extend to the ends of the ERB scale. Fitted by
  // multiplicative updates.
  Bands octaves_for(const ErbBands& energy, const Forms& forms) const;

  // ERB-band energies that octave gains give.
  static ErbBands octave_energy_of(const Bands& levels, const Forms& forms);

  // Share of a band in correcting the error of an ERB band. The shares of a band add up to 1.
  using Shares = std::array<std::array<double, kErbBandCount>, kHrtfBands>;
  const Shares& shares() const { return share_; }

  // Mean square per ERB band for given gains.
  using Levels = std::array<double, kHrtfBands>;
  static ErbBands energy_of(const Levels& levels, const Forms& forms);
  static double largest_miss_db(const ErbBands& energy, const Forms& forms,
                                const HrtfGains& levels);
  ErbBands energy_of(const Levels& levels) const { return energy_of(levels, forms_); }

 private:
  static double largest_log_miss(const ErbBands& energy, const Forms& forms, const Levels& levels);
  void by_turns(const ErbBands& energy, const Forms& forms, Levels& levels) const;
  void by_newton(const ErbBands& energy, const Forms& forms, const Levels& scale,
                 Levels& levels) const;

  Forms forms_;
  Shares share_{};
  std::array<std::size_t, kHrtfBands> first_;  // the first band that overlaps with each
};

}  // namespace clamor
