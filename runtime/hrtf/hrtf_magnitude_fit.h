// hrtf_magnitude_fit.h: finds the levels in a head's bands that have given energies in ERB bands.
//
//     E_b(a) = mean over the frequencies of ERB band b of (sum over j of a_j B_j(f))^2 = a' Q_b a,
//
// so only the matrices Q_b are needed, a few neighbours wide. (Where bands are turned against each
// other, as in hrtf_phase_fit.h, their Q_b are others.) Minimises the sum over b of
// w_b (ln E_b(a) - ln E_b)^2, the weights growing where most is missing, and keeps the levels whose
// largest miss was least. In double.
#pragma once

#include <array>
#include <cstddef>
#include <vector>

#include "runtime/hrtf/hrtf_filter_bank.h"
#include "runtime/hrtf/erb_bands.h"

namespace clamor {

class HrtfMagnitudeFit {
 public:
  HrtfMagnitudeFit();

  struct Form {
    std::size_t first = 0, end = 0;  // bands that are heard in it
    std::array<std::array<double, kHrtfBands>, kHrtfBands> q{};
  };
  using Forms = std::vector<Form>;  // by ERB band
  const Forms& forms() const { return forms_; }

  // All energies above 0.
  HrtfGains levels_for(const ErbBands& energy, const Forms& forms) const;

  // Of octaves, as the buses of octaves do them, with the mean energy of each one's ERB bands, the
  // first and the last going on to where ERB bands end: by turns, as above.
  Bands octaves_for(const ErbBands& energy, const Forms& forms) const;

  // What octaves give so.
  static ErbBands octave_energy_of(const Bands& levels, const Forms& forms);

  // How much of what an ERB band misses is a band's to mend: a band's shares add up to 1.
  using Shares = std::array<std::array<double, kErbBandCount>, kHrtfBands>;
  const Shares& shares() const { return share_; }

  // What levels give: mean square per ERB band.
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
  std::array<std::size_t, kHrtfBands> first_;  // the first band that is heard together with each
};

}  // namespace clamor
