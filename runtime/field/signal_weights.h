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
// around, in the violin room (100 000 sources); in the stadium 483, 146, 112, 60. A sample takes
// 1.8 to 2 times as long as by mean squares, of 150 voices 2.3 to 6 times: bounds hold for the
// loudest moment, and most moments are quieter. (Ratios within a run of
// tests/benchmarks/envelope_benchmark.cpp.)
//
// Immutable once made.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "common/bands.h"
#include "formats/signal_envelope.h"

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

  // Its shares as they are seen from one time, for asking of many delays. Valid while the track is.
  class Seen {
   public:
    // No less than the share at any delay within `give_s` of that one.
    float share(float delay_s, float give_s) const {
      double at = now_ - static_cast<double>(delay_s) * moments_per_s_;
      const double give = 1e-3 + static_cast<double>(give_s) * moments_per_s_;
      if (at < give) at += round_;
      if (give < 0.5 && at >= give && at < last_) {
        const float* const from = shares_ + static_cast<std::int32_t>(at - give);
        return std::max(from[0], from[1]);
      }
      const auto last = static_cast<std::int64_t>(std::floor(at + give));
      float most = 0;
      for (auto m = static_cast<std::int64_t>(std::floor(at - give)); m <= last; ++m)
        most = std::max(most, share_of(m));
      return most;
    }

    // No less than the share at any delay within `give_s` of that one, from now until `ahead_s`
    // later.
    float most_share(float delay_s, float give_s, double ahead_s) const {
      const double at = now_ - static_cast<double>(delay_s) * moments_per_s_;
      const double give = 1e-3 + static_cast<double>(give_s) * moments_per_s_;
      auto first = static_cast<std::int64_t>(std::floor(at - give));
      auto last = static_cast<std::int64_t>(std::floor(at + give + ahead_s * moments_per_s_));
      if (loop_) {
        if (last - first >= count_) return most_;
        const std::int64_t turns = (first >= 0 ? first : first - count_ + 1) / count_;
        first -= turns * count_;
        last -= turns * count_;
      } else {
        first = std::max<std::int64_t>(first, 0);
        last = std::min(last, count_ - 1);
      }
      float most = 0;
      for (; first <= last; first = std::min((first / kFew + 1) * kFew, count_)) {
        if (first >= count_) {  // of a loop
          first -= count_;
          last -= count_;
        }
        most = std::max(most, of_few_[first / kFew]);
      }
      return most;
    }

   private:
    friend class LoudnessTrack;
    float share_of(std::int64_t moment) const {
      if (moment < 0 || moment >= count_) {
        if (!loop_) return 0;
        moment %= count_;
        if (moment < 0) moment += count_;
      }
      return shares_[moment];
    }
    const float *shares_ = nullptr, *of_few_ = nullptr;
    float most_ = 0;
    std::int64_t count_ = 0;
    double now_ = 0, moments_per_s_ = 0;  // in moments, from the first
    double round_ = 0, last_ = 0;         // of a loop; the last but one
    bool loop_ = false;
  };
  Seen seen_at(double time_s) const;

  // The highest of each band from one time to another, and at any time.
  Bands most_between(double from_s, double to_s) const;
  const Bands& most() const { return most_; }
  // The same at all times?
  bool steady() const { return steady_; }

 private:
  static constexpr Bands kSilence{};
  static constexpr std::int64_t kStretch = 32, kFew = 8;

  bool loop_, steady_ = false;
  double moments_per_s_;
  std::int64_t first_ = 0;  // moment of by_moment_[0]
  std::vector<Bands> by_moment_;
  std::vector<float> shares_, shares_of_few_;  // of each moment, and the most of kFew
  std::vector<Bands> most_of_stretch_;         // of kStretch moments each
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
