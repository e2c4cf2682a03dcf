// deposit_weight.h: how much a deposit matters among all of the bake, for thinning.
//
// Let E_b(t) be the estimated decay in band b (weight_window.h). A deposit of power P_b, whose path
// has taken the time t, has the weight
//
//     w = sum over b of  P_b / E_b(t)  times  mean over b of  E_b(t)^0.6,
//
// and is kept with a probability proportional to w^(3/4). Without an estimate, w is the power
// summed over bands. The expected power of every deposit is unchanged, whatever E is.
//
// The first factor compares a deposit with others of its time in each band, so that those which are
// strong in low bands alone do not crowd out those that carry the highest. For one sum of deposits,
// probabilities proportional to w have the least variance. But a receiver near a surface that
// absorbs hears its weak deposits most, hence the root. The second factor divides the sources among
// the parts of the decay: an exponent below 0.6 makes T30 more certain, and C80 less.
//
// What thinning alone adds to a result is known from all deposits: the variance of a sum of
// received powers r is the sum of r^2 (1 / q - 1) for probabilities q. In just-noticeable
// differences, root mean square over 125 Hz, 500 Hz, 4 kHz and the six places of `clamor experiment
// seeds`, of C80 and T30; and the effective number of arrivals between -30 and -45 dB of the decay,
// (sum r)^2 / sum (r^2 / q), in decibels. 200 000 sources of the violin room, the hall, Sponza and
// (5000 photons) the stadium:
//
//   w^(1/2), exponent 0.8     0.061 0.24 17.1   0.107 0.37 19.1   0.110 0.53 14.3   0.40 0.38 12.1
//   w^(1/2), 0.25 to 1        0.060 0.28 17.3   0.125 0.37 19.5   0.166 0.40 15.6   0.36 0.21 12.3
//   w^(3/4), exponent 0.4     0.071 0.12 18.1   0.138 0.21 22.8   0.155 0.27 16.2   0.31 0.16 12.4
//   w^(3/4), exponent 0.6     0.049 0.18 17.6   0.112 0.32 20.1   0.109 0.39 14.8   0.30 0.25 12.2
//   w^(3/4), exponent 0.8     0.043 0.30 16.6   0.098 0.52 16.8   0.071 0.61 13.3   0.32 0.37 12.0
//   w, exponent 0.45          0.054 0.15 17.9   0.130 0.26 21.3   0.130 0.31 15.7   0.25 0.19 12.3
//   all deposits              0     0    18.7   0     0    27.1   0     0    18.5   0    0    12.5
//
// "0.25 to 1" rises between -10 and -20 dB. Random numbers spread evenly over a bounce of a run, or
// a sum of probabilities carried on, leave the figures of the hall and the violin room as they are.
#pragma once

#include <cmath>
#include <cstddef>

#include "common/bands.h"
#include "common/maths.h"

namespace clamor {

struct DecayModel;

// The probability that a deposit is kept is proportional to this.
template <class Real>
CLAMOR_INLINE Real odds_of(Real weight) {
  const Real root = std::sqrt(weight);
  return root * std::sqrt(root);
}

class DepositWeight {
 public:
  DepositWeight() = default;
  explicit DepositWeight(const DecayModel& decay);

  CLAMOR_INLINE float of(const Bands& power, float path_m) const {
    Bands among_its_time, of_its_time;
    for (std::size_t b = 0; b < kBandCount; ++b) {
      const float before_m = path_m < knee_m_[b] ? path_m : knee_m_[b];
      const float lost =
          before_m * early_log2_loss_per_m_[b] + (path_m - before_m) * late_log2_loss_per_m_[b];
      const float lost_log2 = lost < kMostLost_log2 ? lost : kMostLost_log2;
      among_its_time[b] = power[b] * exp2_of(lost_log2);
      of_its_time[b] = exp2_of(-kShareExponent * lost_log2);
    }
    float weight = 0, share = 0;
    for (std::size_t b = 0; b < kBandCount; ++b) {
      weight += among_its_time[b];
      share += of_its_time[b];
    }
    return weight * share / kBandCount;
  }

  // The tracer's kernel computes the same with vectors.
  static constexpr float kMostLost_log2 = 23;  // -70 dB; beyond it, the estimate is not trusted
  static constexpr float kShareExponent = 0.6f;
  const Bands& knee_m() const { return knee_m_; }
  const Bands& early_log2_loss_per_m() const { return early_log2_loss_per_m_; }
  const Bands& late_log2_loss_per_m() const { return late_log2_loss_per_m_; }

 private:
  Bands knee_m_{}, early_log2_loss_per_m_{}, late_log2_loss_per_m_{};
};

}  // namespace clamor
