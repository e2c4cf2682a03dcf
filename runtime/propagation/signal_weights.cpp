#include "runtime/propagation/signal_weights.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "common/sample_rate.h"
#include "runtime/propagation/loudness.h"

namespace clamor {

namespace {

constexpr double kMaxMoment = 1e15;  // beyond any real time; a forged file may hold more

void raise(Bands& max, const Bands& to) {
  for (std::size_t b = 0; b < kBandCount; ++b) max[b] = std::max(max[b], to[b]);
}

Bands loudness_weighted(const Bands& weights, Bands levels) {
  for (std::size_t b = 0; b < kBandCount; ++b) levels[b] *= weights[b];
  return levels;
}

// One value per moment of a signal. Loops repeat; other signals are zero before and after.
class MomentSeries {
 public:
  MomentSeries(std::size_t count, bool loop) : values_(count), loop_(loop) {}

  std::int64_t size() const { return static_cast<std::int64_t>(values_.size()); }
  double& operator[](std::size_t moment) { return values_[moment]; }
  double at(std::int64_t moment) const {
    if (loop_) return values_[static_cast<std::size_t>((moment % size() + size()) % size())];
    return moment >= 0 && moment < size() ? values_[static_cast<std::size_t>(moment)] : 0;
  }

  // The mean over `reach` moments to either side.
  MomentSeries mean(std::int64_t reach) const {
    return each([&](std::int64_t moment) {
      double sum = 0;
      for (std::int64_t k = moment - reach; k <= moment + reach; ++k) sum += at(k);
      return sum / static_cast<double>(2 * reach + 1);
    });
  }
  // The maximum from `before` moments earlier until `after` moments later.
  MomentSeries maximum(std::int64_t before, std::int64_t after) const {
    return each([&](std::int64_t moment) {
      double maximum = 0;
      for (std::int64_t k = moment - before; k <= moment + after; ++k)
        maximum = std::max(maximum, at(k));
      return maximum;
    });
  }
  // Holds its level while that is between the value and `give` times the value. A loop runs through
  // once before, to reach its periodic state.
  MomentSeries with_hysteresis(double give) const {
    double level = 0;
    const auto next = [&](std::int64_t moment) {
      return level = std::clamp(level, at(moment), give * at(moment));
    };
    if (loop_) (void)each(next);
    return each(next);
  }

 private:
  template <class Function>
  MomentSeries each(const Function& value_of) const {
    MomentSeries made(values_.size(), loop_);
    for (std::int64_t moment = 0; moment < size(); ++moment)
      made[static_cast<std::size_t>(moment)] = value_of(moment);
    return made;
  }

  std::vector<double> values_;
  bool loop_;
};

}  // namespace

LoudnessTrack::LoudnessTrack(const SignalEnvelope& envelope, std::uint64_t frames, bool loop,
                             const Bands& loudness, const EnvelopeSmoothing& smoothing)
    : loop_(loop) {
  const std::size_t moments = envelope.moments();
  if (moments == 0) loop_ = loop = false;  // no samples: silent
  const double moment_frames =
      loop ? static_cast<double>(frames) / static_cast<double>(moments) : kMomentFrames;
  moments_per_s_ = kSampleRate_hz / moment_frames;
  const std::int64_t around = std::llround(smoothing.around_s * moments_per_s_);
  const std::int64_t forget = std::llround(smoothing.forget_s * moments_per_s_);
  const bool momentary = !(smoothing.mean_s > 0);
  const auto before = static_cast<std::size_t>(loop || momentary ? 0 : around);
  const auto after = static_cast<std::size_t>(loop || momentary ? 0 : around + forget);
  first_ = -static_cast<std::int64_t>(before);
  by_moment_.resize(before + moments + after);

  const Bands mean = loudness_weighted(loudness, envelope.mean_square());
  const double mean_sum = std::accumulate(mean.begin(), mean.end(), 0.0);
  MomentSeries level(by_moment_.size(), loop), sounds(by_moment_.size(), loop);
  for (std::size_t m = 0; m < moments; ++m) {
    const Bands now = loudness_weighted(loudness, envelope.at(m));
    if (momentary) by_moment_[m] = now;
    const double now_sum = std::accumulate(now.begin(), now.end(), 0.0);
    if (!(now_sum > 0)) continue;
    level[before + m] = now_sum / mean_sum;
    sounds[before + m] = 1;
  }
  if (!momentary && mean_sum > 0) {
    // Two means of half the length make a smooth kernel.
    const std::int64_t reach = std::llround(smoothing.mean_s * moments_per_s_ / 4);
    const std::int64_t hold = std::llround(smoothing.hold_s * moments_per_s_);
    const MomentSeries bursts = level.maximum(around, around);
    const double below_bursts = std::pow(10, -smoothing.burst_db / 10);
    level = level.mean(reach)
                .mean(reach)
                .maximum(hold, around)
                .with_hysteresis(std::pow(10, smoothing.give_db / 10));
    for (std::int64_t m = 0; m < level.size(); ++m) {
      double& here = level[static_cast<std::size_t>(m)];
      here = std::max(here, below_bursts * bursts.at(m));
    }
    sounds = sounds.maximum(around + forget, around);
    for (std::size_t m = 0; m < by_moment_.size(); ++m)
      if (sounds[m] > 0)
        for (std::size_t b = 0; b < kBandCount; ++b)
          by_moment_[m][b] = static_cast<float>(mean[b] * level[m]);
  }
  for (const Bands& moment : by_moment_) raise(max_, moment);
  for (std::size_t m = 0; m < by_moment_.size(); ++m) {
    const Bands& moment = by_moment_[m];
    if (m % kCoarseMoments == 0) coarse_max_.push_back({});
    raise(coarse_max_.back(), moment);
    const Bands shares = shares_of(moment);
    shares_.push_back(*std::max_element(shares.begin(), shares.end()));
    if (m % kFineMoments == 0) fine_shares_.push_back({});
    raise(fine_shares_.back(), shares);
  }
  fill_window_shares();
  steady_ = loop && std::all_of(by_moment_.begin(), by_moment_.end(),
                                [&](const Bands& moment) { return moment == max_; });
}

LoudnessTrack::LoudnessTrack(const Bands& weights, const Bands& max)
    : loop_(true), steady_(true), moments_per_s_(1), by_moment_{weights}, max_(max) {
  const Bands shares = shares_of(weights);
  shares_ = {*std::max_element(shares.begin(), shares.end())};
}

// Rounded up, because the fractions are upper bounds.
Bands LoudnessTrack::shares_of(const Bands& moment) const {
  constexpr float kRoundUp = 1.0001f;
  Bands shares{};
  for (std::size_t b = 0; b < kBandCount; ++b)
    if (max_[b] > 0) shares[b] = moment[b] / max_[b] * kRoundUp;
  return shares;
}

void LoudnessTrack::fill_window_shares() {
  const auto count = static_cast<std::int64_t>(by_moment_.size());
  for (std::size_t r = 0; r < kWindows && count > 0; ++r) {
    const auto reach = static_cast<std::int64_t>(r + 1), beyond = loop_ ? 0 : reach;
    for (std::int64_t m = -beyond; m < count + beyond; ++m) {
      Bands max{};
      for (std::int64_t k = m - reach; k <= m + reach; ++k)
        if (loop_ || (k >= 0 && k < count))
          raise(max, by_moment_[static_cast<std::size_t>((k % count + count) % count)]);
      window_shares_[r].push_back(BandShares::at_least(shares_of(max)));
    }
  }
}

void LoudnessTrack::shares_by_delay(double time_s, double per_s, double margin_s,
                                    std::span<BandShares> shares) const {
  const double reach = (0.5 / per_s + margin_s + 1e-4) * moments_per_s_;
  if (reach > kWindows) return std::fill(shares.begin(), shares.end(), BandShares::whole());
  const auto r = static_cast<std::size_t>(std::max(std::ceil(reach), 1.0)) - 1;
  const std::vector<BandShares>& around = window_shares_[r];
  const auto count = static_cast<double>(around.size());
  const double now = time_s * moments_per_s_ - static_cast<double>(first_) +
                     (loop_ ? 0 : static_cast<double>(r + 1));
  for (std::size_t d = 0; d < shares.size(); ++d) {
    double at = std::floor(now - (static_cast<double>(d) + 0.5) / per_s * moments_per_s_);
    if (loop_) at -= std::floor(at / count) * count;
    shares[d] = at >= 0 && at < count ? around[static_cast<std::size_t>(at)] : BandShares();
  }
}

float LoudnessTrack::max_share(BandMix mix, double time_s, float delay_s, float margin_s,
                               double ahead_s) const {
  const double at =
      (time_s - static_cast<double>(delay_s)) * moments_per_s_ - static_cast<double>(first_);
  const double rounding_s = 0x1p-24 * std::abs(static_cast<double>(delay_s));
  const double margin = 1e-3 + (static_cast<double>(margin_s) + rounding_s) * moments_per_s_;
  if (!(std::abs(at) + margin < kMaxMoment)) return mix.of(shares_of(max_));
  const auto count = static_cast<std::int64_t>(by_moment_.size());
  auto first = static_cast<std::int64_t>(std::floor(at - margin));
  auto last = static_cast<std::int64_t>(std::floor(at + margin + ahead_s * moments_per_s_));
  if (loop_) {
    if (last - first >= count) return mix.of(shares_of(max_));
    const std::int64_t turns = (first >= 0 ? first : first - count + 1) / count;
    first -= turns * count;
    last -= turns * count;
  } else {
    first = std::max<std::int64_t>(first, 0);
    last = std::min(last, count - 1);
  }
  Bands max{};
  for (; first <= last; first = std::min((first / kFineMoments + 1) * kFineMoments, count)) {
    if (first >= count) {  // a loop begins anew
      first -= count;
      last -= count;
    }
    raise(max, fine_shares_[static_cast<std::size_t>(first / kFineMoments)]);
  }
  return mix.of(max);
}

Bands LoudnessTrack::max_between(double from_s, double to_s) const {
  const auto count = static_cast<std::int64_t>(by_moment_.size());
  std::int64_t from = static_cast<std::int64_t>(std::floor(from_s * moments_per_s_)) - first_;
  std::int64_t to = static_cast<std::int64_t>(std::floor(to_s * moments_per_s_)) - first_;
  if (loop_) {
    if (to - from + 1 >= count) return max_;
    const std::int64_t round = (from >= 0 ? from / count : -((count - 1 - from) / count)) * count;
    from -= round;
    to -= round;
  } else {
    from = std::max<std::int64_t>(from, 0);
    to = std::min(to, count - 1);
  }
  Bands max{};
  while (from <= to) {
    const std::int64_t at = from % count;
    if (at % kCoarseMoments == 0 && from + kCoarseMoments - 1 <= to &&
        at + kCoarseMoments <= count) {
      raise(max, coarse_max_[static_cast<std::size_t>(at / kCoarseMoments)]);
      from += kCoarseMoments;
    } else {
      raise(max, by_moment_[static_cast<std::size_t>(at)]);
      ++from;
    }
  }
  return max;
}

LoudnessTrack make_loudness_track(const TimedEnvelope& signal,
                                  const EnvelopeSmoothing& smoothing) {
  return {signal.envelope, signal.frames, signal.loop, loudness_weights(), smoothing};
}

SignalWeights make_signal_weights(std::span<const TimedEnvelope> signals,
                                  const EnvelopeSmoothing& smoothing) {
  const Bands loudness = loudness_weights();
  SignalWeights weights;
  bool steady = true;
  for (const TimedEnvelope& signal : signals) {
    const LoudnessTrack& track = weights.tracks.emplace_back(signal.envelope, signal.frames,
                                                             signal.loop, loudness, smoothing);
    weights.by_signal.push_back(track.max());
    steady = steady && track.steady();
  }
  if (steady) weights.tracks.clear();
  return weights;
}

}  // namespace clamor
