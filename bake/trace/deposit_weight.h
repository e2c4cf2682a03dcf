// deposit_weight.h: how much a deposit matters among all of the bake, for thinning.
//
// Let E_b(t) be the estimated decay in band b (weight_window.h). A deposit of power P_b, whose path
// has taken the time t, has the weight
//
//     w = sum over b of  P_b / E_b(t)  times  mean over b of  E_b(t)^0.8,
//
// and is kept with a probability proportional to w^(1/2). Without an estimate, w is the power
// summed over bands. The expected power of every deposit is unchanged, whatever E is.
//
// The first factor compares a deposit with others of its time in each band, so that those which are
// strong in low bands alone do not crowd out those that carry the highest. For one sum of deposits,
// probabilities proportional to w have the least variance. But a receiver near a surface that
// absorbs hears its weak deposits most, hence the square root. The second factor divides the
// sources among the parts of the decay: an exponent below 0.8 makes T30 more certain, and C80 less.
//
// What thinning alone adds to a result is known from all deposits: the variance of a sum of
// received powers r is the sum of r^2 (1 / q - 1) for probabilities q. At 4 kHz, C80 in dB, T30 in
// percent, and the effective number of arrivals from 600 to 700 ms, (sum r)^2 / sum (r^2 / q), in
// decibels, for the default number of sources and the mean of six places, of the violin room, the
// hall and (an eighth of the photons, four places) the stadium:
//
//   P^(1/4) in two steps           0.23  3.6   5.6    0.42  3.0  17.7    3.3  21  2.9
//   w^(1/2), exponent 0.8          0.19  1.7  10.9    0.46  2.5  18.0    3.2  12  6.5
//   w^(1/2), exponent 0.6          0.25  1.4  12.5    0.53  2.0  18.4    3.5  11  6.9
//   w, exponent 0.36               0.32  1.4  13.4    0.77  1.7  18.1    5.5   8  8.7
//   w^(1/2), fixed shares by part  0.29  1.1  13.9    0.55  1.8  17.7    3.4   7  9.4
//   all deposits                   0     0    16.0    0     0    24.2    0     0 15.4
//
// The fixed shares are 50, 20, 10, 8, 6 and 6 % of the sources for each 10 dB.
#pragma once

#include <cstddef>

#include "common/bands.h"
#include "common/maths.h"

namespace clamor {

struct DecayModel;

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
  static constexpr float kShareExponent = 0.8f;
  const Bands& knee_m() const { return knee_m_; }
  const Bands& early_log2_loss_per_m() const { return early_log2_loss_per_m_; }
  const Bands& late_log2_loss_per_m() const { return late_log2_loss_per_m_; }

 private:
  Bands knee_m_{}, early_log2_loss_per_m_{}, late_log2_loss_per_m_{};
};

}  // namespace clamor
