// signal_weights.h: how much what a source plays now counts towards loudness, per band.
//
// A weight is loudness_b (loudness.h) times the mean square of the signal in the band, over the
// whole signal, times the level of the signal around the moment that is heard: at `time - delay` of
// its own time. Loops come round; what plays once is silent before and after.
//
// A choice that follows the momentary envelope makes the room change with the music: sources hear
// the envelope at different delays, so each change of level or of spectrum reorders them while it
// passes, and others are heard. Therefore
//
// * the level is the mean of all bands over `mean_s`, about as long as a room decays,
// * the highest of the last `hold_s` counts,
// * it stays where it is until that has fallen by `give_db`: what counts is how far the level goes
//   up and down in total, not how fast,
// * it is never more than `burst_db` below the loudest 20 ms within `around_s`: claps and strokes
// would otherwise
//   be chosen too seldom and be scaled up so far that single ones stick out,
// * bands keep their proportions,
// * and silence alone is momentary: a signal weighs nothing until `around_s` before it sounds,
//   which is as long as a source takes to fade in, and from `around_s` + `forget_s` after it ends.
//
// The weight of a band may be less than what plays in it at the moment. The factor of a chosen
// source (sampler.h) makes up for that: the power is right on average, as long as nothing that
// sounds weighs nothing.
//
// What no fixed filter makes of the dry violin (time_varying_part.h), by one who stands 4 m away in
// the violin room, with 2000 of 200 000 sources; all of them: below -60 dB.
//
//   loudest moment of 20 ms within 0.1 s, falling by 1 / e in 0.15 s    -17.3 dB
//   mean per band over 0.7 s / 1.4 s / 3 s                              -17.1 / -17.5 / -18.0
//   one level for all bands, over 1.4 s, followed within +-6 dB         -20.4
//   as above, over 3 s, from -3 to +12 dB                               -30.6
//   mean over 1.4 s, held for 1.5 s, from 0 to 12 dB                    -25.0
//   mean over 0.7 s, held for 2 s, from 0 to 12 dB                      below -59
//   as above, and never less than the loudest moment: this              -30.6
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
#include "formats/bake_file/signal_envelope.h"
#include "runtime/propagation/band_mix.h"

namespace clamor {

struct EnvelopeSmoothing {
  double around_s = 0.1;  // as long as a source takes to fade in
  double mean_s = 0.7;    // 0: each moment of 20 ms as it is, band by band
  double hold_s = 2;
  double forget_s = 0.5;
  double give_db = 12;
  double burst_db = 0;
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
  float max_share(BandMix mix, double time_s, float delay_s, float give_s, double ahead_s) const;

  // The highest of each band from one time to another, and at any time.
  Bands max_between(double from_s, double to_s) const;
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
