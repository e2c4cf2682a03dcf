// signal_weights.h: how much what a source plays now counts towards loudness, per band.
//
// A weight is loudness_b (loudness.h) times the mean square of the signal in the band around the
// moment that is heard: at `time - delay` of its own time. Loops come round; what plays once is
// silent before and after.
//
// Around the moment, because a source is heard in full only some keyframes after it is chosen, and
// because who is chosen should not change with every syllable: of the envelope's moments of 20 ms
// (signal_envelope.h) it takes the loudest within `around_s` before and after, and lets it die away
// from there with the time constant `fall_s`, until there has been nothing for `forget_s`. So a
// source is weighed as what it is about to play while it fades in, is never weighed as less than
// what it plays now, and a silent one weighs nothing.
//
// Of 2000 voices of one who stands still are exchanged each second, in percent: 286 by the moments
// as they are, 67 smoothed like this, 49 with twice the fall, 28 with four times the fall and twice
// around, in the violin room (100 000 sources); in the stadium 483, 146, 112, 60. A sample of 2000
// voices of one who walks takes 2.2 times as long as by mean squares in the stadium, 4.5 times in
// the violin room, of 150 voices 2 and 11 times: thresholds rise and fall with what is played, and
// what is looked at reaches as low as they fall. (Ratios within a run of
// tests/benchmarks/envelope_benchmark.cpp.)
//
// Immutable once made.
#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "common/bands.h"
#include "formats/signal_envelope.h"
#include "runtime/field/band_mix.h"

namespace clamor {

struct EnvelopeSmoothing {
  double around_s = 0.1;  // as long as a source takes to fade in
  double fall_s = 0.15;   // to 1 / e of the power
  double forget_s = 0.5;
};

// The weight of one signal over its own time.
class LoudnessTrack {
 public:
  LoudnessTrack(const SignalEnvelope& envelope, std::uint64_t frames, bool loop,
                const Bands& loudness, const EnvelopeSmoothing& smoothing);

  // The weights at a time, and a share of `most` that no band of them exceeds.
  struct Moment {
    const Bands& weights;
    float share;
  };
  Moment at(double time_s) const {
    std::int64_t moment = static_cast<std::int64_t>(std::floor(time_s * moments_per_s_)) - first_;
    const auto count = static_cast<std::int64_t>(by_moment_.size());
    if (moment < 0 || moment >= count) {
      if (!loop_) return {kSilence, 0};
      moment %= count;
      if (moment < 0) moment += count;
    }
    const auto place = static_cast<std::size_t>(moment);
    return {by_moment_[place], shares_[place]};
  }

  // No less than what its bands are of their loudest, heard at a time with a delay that is off by
  // up to `give_s`: shares[d] for delays from d / per_s to (d + 1) / per_s.
  void shares_by_delay(double time_s, double per_s, double give_s,
                       std::span<BandShares> shares) const;
  // No less than what is heard of a source of such a mix, as a share of the loudest it ever is,
  // from a time until `ahead_s` later. A delay is rounded to a float, `give_s` comes on top.
  float most_share(BandMix mix, double time_s, float delay_s, float give_s, double ahead_s) const;

  // The highest of each band from one time to another, and at any time.
  Bands most_between(double from_s, double to_s) const;
  const Bands& most() const { return most_; }
  // The same at all times?
  bool steady() const { return steady_; }

 private:
  static constexpr Bands kSilence{};
  static constexpr std::int64_t kStretch = 32, kFew = 8;
  static constexpr std::size_t kReaches = 4;  // of moments around one, to either side

  Bands shares_of(const Bands& moment) const;
  void bound_shares();

  bool loop_, steady_ = false;
  double moments_per_s_;
  std::int64_t first_ = 0;  // moment of by_moment_[0]
  std::vector<Bands> by_moment_;
  std::vector<float> shares_;         // of each moment,
  std::vector<Bands> shares_of_few_;  // and the most of each band in kFew
  // The most around each, by how many moments to either side. What plays once has that many more
  // at its ends.
  std::array<std::vector<BandShares>, kReaches> shares_around_;
  std::vector<Bands> most_of_stretch_;  // of kStretch moments each
  Bands most_{};
};

// What an intensity is weighed with.
struct SignalWeights {
  std::vector<Bands> by_signal;         // at its loudest; what does not change, always
  std::vector<LoudnessTrack> tracks{};  // per signal, or none if nothing changes

  bool steady() const { return tracks.empty(); }
};

// A signal as its envelope and what that is of.
struct TimedEnvelope {
  SignalEnvelope envelope;
  std::uint64_t frames = 0;
  bool loop = false;
};

SignalWeights make_signal_weights(std::span<const TimedEnvelope> signals,
                                  const EnvelopeSmoothing& smoothing = {});

}  // namespace clamor
