// signal_weights.h: loudness weights of what a source plays at a time, per band.
//
// A weight is loudness_b (loudness.h) times the signal's mean square in the band, times the level
// of the signal around the moment that is received, at `time - delay` of its own time. Loops
// repeat; other signals are silent before and after.
//
// A sample that followed the momentary envelope would make the room change with the music, because
// sources receive the envelope at different delays. Therefore
//
// * the level is the mean of all bands over `mean_s`, about as long as a room decays, and the
//   highest level of the last `hold_s` counts,
// * a hysteresis holds the level until that has fallen by `give_db`,
// * the level is never more than `burst_db` below the loudest 20 ms within `around_s`; otherwise
//   claps and strokes would be chosen too seldom, and scaled up so far that single ones stand out,
// * the bands keep their proportions,
// * and only silence is momentary: a weight is zero until `around_s` before the signal sounds, as
//   long as a source takes to fade in, and from `around_s` + `forget_s` after it ends.
//
// A weight may be below what the band plays at the moment. The scale of a chosen source (sampler.h)
// compensates: the power is right on average as long as no sounding signal has zero weight. What
// other rules cost is in runtime/README.md, "Sampling". Immutable.
#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "common/bands.h"
#include "formats/bake_file/signal_envelope.h"
#include "runtime/propagation/band_mix.h"

namespace clamor {

struct EnvelopeSmoothing {
  double around_s = 0.1;  // the fade-in of a source
  double mean_s = 0.7;    // 0: no smoothing; each moment of 20 ms keeps its own spectrum
  double hold_s = 2;
  double forget_s = 0.5;
  double give_db = 12;
  double burst_db = 0;
};

// The weights of one signal over its own time, in moments of about 20 ms.
class LoudnessTrack {
 public:
  LoudnessTrack(const SignalEnvelope& envelope, std::uint64_t frames, bool loop,
                const Bands& loudness, const EnvelopeSmoothing& smoothing);

  // Constant weights of at most `max`.
  LoudnessTrack(const Bands& weights, const Bands& max);

  // The weights at a time, and an upper bound of each as a fraction of max().
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

  // Upper bounds of the weights as fractions of max(), for signals received at a time with a delay
  // that errs by up to `margin_s`: shares[d] covers delays from d / per_s to (d + 1) / per_s.
  void shares_by_delay(double time_s, double per_s, double margin_s,
                       std::span<BandShares> shares) const;
  // Upper bound of a source's weight as a fraction of its maximum, from a time until `ahead_s`
  // later. Covers the rounding of the delay to a float, and `margin_s` on top.
  float max_share(BandMix mix, double time_s, float delay_s, float margin_s, double ahead_s) const;

  // Maximum of each band's weight from one time to another, and over all time.
  Bands max_between(double from_s, double to_s) const;
  const Bands& max() const { return max_; }
  // Returns whether the weights are constant.
  bool steady() const { return steady_; }

 private:
  static constexpr Bands kSilence{};
  // Moments per entry of the coarse and the fine table of maxima.
  static constexpr std::int64_t kCoarseMoments = 32, kFineMoments = 8;
  // Window sizes of the maxima around a moment: 1 to 4 moments to either side.
  static constexpr std::size_t kWindows = 4;

  Bands shares_of(const Bands& moment) const;
  void fill_window_shares();

  bool loop_, steady_ = false;
  double moments_per_s_;
  std::int64_t first_ = 0;  // moment of by_moment_[0]
  std::vector<Bands> by_moment_;
  std::vector<float> shares_;       // largest band of each moment, as a fraction of max_
  std::vector<Bands> fine_shares_;  // maxima of kFineMoments moments, as fractions of max_
  // Maxima around each moment, by window size. Signals that play once have as many more moments at
  // either end as the window reaches.
  std::array<std::vector<BandShares>, kWindows> window_shares_;
  std::vector<Bands> coarse_max_;  // maxima of kCoarseMoments moments
  Bands max_{};
};

// The weights of all signals.
struct SignalWeights {
  std::vector<Bands> by_signal;         // maxima over time
  std::vector<LoudnessTrack> tracks{};  // per signal; empty if all signals are steady
  // Weights of the signals that follow those: slots whose signals are replaced while others play
  // (replaceable_signals.h). Copies share them; the sampler's thread writes them. May be null.
  std::shared_ptr<std::vector<LoudnessTrack>> slots{};

  bool steady() const { return tracks.empty(); }

  // The weights of a signal at a time of its own, and their maxima over time.
  LoudnessTrack::Moment at(std::uint32_t signal, double time_s) const {
    if (signal >= by_signal.size()) return (*slots)[signal - by_signal.size()].at(time_s);
    if (steady()) return {by_signal[signal], 1};
    return tracks[signal].at(time_s);
  }
  // Maximum of each band's weight from one time of the signal's own to another.
  Bands max_between(std::uint32_t signal, double from_s, double to_s) const {
    if (signal >= by_signal.size())
      return (*slots)[signal - by_signal.size()].max_between(from_s, to_s);
    return steady() ? by_signal[signal] : tracks[signal].max_between(from_s, to_s);
  }
  const Bands& max(std::uint32_t signal) const {
    return signal < by_signal.size() ? by_signal[signal]
                                     : (*slots)[signal - by_signal.size()].max();
  }
};

// A signal's envelope with its length.
struct TimedEnvelope {
  SignalEnvelope envelope;
  std::uint64_t frames = 0;
  bool loop = false;
};

LoudnessTrack make_loudness_track(const TimedEnvelope& signal,
                                  const EnvelopeSmoothing& smoothing = {});
SignalWeights make_signal_weights(std::span<const TimedEnvelope> signals,
                                  const EnvelopeSmoothing& smoothing = {});

}  // namespace clamor
