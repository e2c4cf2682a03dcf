#include "runtime/field/signal_weights.h"

#include <algorithm>
#include <cmath>

#include "runtime/field/loudness.h"

namespace clamor {

namespace {

constexpr double kNoMoment = 1e15;  // none is as far from the first

void raise(Bands& most, const Bands& to) {
  for (std::size_t b = 0; b < kBandCount; ++b) most[b] = std::max(most[b], to[b]);
}

// One band of an envelope, smoothed. `levels` has room for what comes before and after.
void smooth(std::vector<float>& levels, bool loop, std::int64_t around, double keeps,
            std::int64_t forget) {
  const auto size = static_cast<std::int64_t>(levels.size());
  const auto place = [&](std::int64_t m) {
    return static_cast<std::size_t>((m % size + size) % size);
  };
  std::vector<float> loudest(levels.size());
  for (std::int64_t m = 0; m < size; ++m)
    for (std::int64_t k = std::max(m - around, m - size); k <= std::min(m + around, m + size); ++k)
      if (loop || (k >= 0 && k < size))
        loudest[place(m)] = std::max(loudest[place(m)], levels[place(k)]);
  // A loop goes round once before, to know what it comes from.
  float level = 0;
  std::int64_t since = forget;
  for (std::int64_t m = loop ? -size : 0; m < size; ++m) {
    const float now = loudest[place(m)];
    since = now > 0 ? 0 : since + 1;
    level = since > forget ? 0 : std::max(now, static_cast<float>(level * keeps));
    levels[place(m)] = level;
  }
}

}  // namespace

LoudnessTrack::LoudnessTrack(const SignalEnvelope& envelope, std::uint64_t frames, bool loop,
                             const Bands& loudness, const EnvelopeSmoothing& smoothing)
    : loop_(loop) {
  const std::size_t moments = envelope.moments();
  if (moments == 0) loop_ = loop = false;  // no sound: silent at all times
  const double moment_frames =
      loop ? static_cast<double>(frames) / static_cast<double>(moments) : kMomentFrames;
  moments_per_s_ = kSampleRate_hz / moment_frames;
  const auto around = std::llround(smoothing.around_s * moments_per_s_);
  const auto forget = std::llround(smoothing.forget_s * moments_per_s_);
  const double keeps =
      smoothing.fall_s > 0 ? std::exp(-1 / (smoothing.fall_s * moments_per_s_)) : 0;
  const auto before = static_cast<std::size_t>(loop ? 0 : around);
  const auto after = static_cast<std::size_t>(loop ? 0 : around + forget);
  first_ = -static_cast<std::int64_t>(before);
  by_moment_.resize(before + moments + after);

  std::vector<float> levels;
  for (std::size_t b = 0; b < kBandCount; ++b) {
    levels.assign(by_moment_.size(), 0);
    for (std::size_t m = 0; m < moments; ++m) levels[before + m] = loudness[b] * envelope.at(m)[b];
    smooth(levels, loop, around, keeps, forget);
    for (std::size_t m = 0; m < levels.size(); ++m) {
      by_moment_[m][b] = levels[m];
      most_[b] = std::max(most_[b], levels[m]);
    }
  }
  for (std::size_t m = 0; m < by_moment_.size(); ++m) {
    const Bands& moment = by_moment_[m];
    if (m % kStretch == 0) most_of_stretch_.push_back({});
    raise(most_of_stretch_.back(), moment);
    const Bands shares = shares_of(moment);
    shares_.push_back(*std::max_element(shares.begin(), shares.end()));
    if (m % kFew == 0) shares_of_few_.push_back({});
    raise(shares_of_few_.back(), shares);
  }
  bound_shares();
  steady_ = loop && std::all_of(by_moment_.begin(), by_moment_.end(),
                                [&](const Bands& moment) { return moment == most_; });
}

// Rounded up, for a bound must never be too low.
Bands LoudnessTrack::shares_of(const Bands& moment) const {
  constexpr float kRoundedUp = 1.0001f;
  Bands shares{};
  for (std::size_t b = 0; b < kBandCount; ++b)
    if (most_[b] > 0) shares[b] = moment[b] / most_[b] * kRoundedUp;
  return shares;
}

void LoudnessTrack::bound_shares() {
  const auto count = static_cast<std::int64_t>(by_moment_.size());
  for (std::size_t r = 0; r < kReaches && count > 0; ++r) {
    const auto reach = static_cast<std::int64_t>(r + 1), beyond = loop_ ? 0 : reach;
    for (std::int64_t m = -beyond; m < count + beyond; ++m) {
      Bands most{};
      for (std::int64_t k = m - reach; k <= m + reach; ++k)
        if (loop_ || (k >= 0 && k < count))
          raise(most, by_moment_[static_cast<std::size_t>((k % count + count) % count)]);
      shares_around_[r].push_back(BandShares::at_least(shares_of(most)));
    }
  }
}

void LoudnessTrack::shares_by_delay(double time_s, double per_s, double give_s,
                                    std::span<BandShares> shares) const {
  const double reach = (0.5 / per_s + give_s + 1e-4) * moments_per_s_;
  if (reach > kReaches) return std::fill(shares.begin(), shares.end(), BandShares::whole());
  const auto r = static_cast<std::size_t>(std::max(std::ceil(reach), 1.0)) - 1;
  const std::vector<BandShares>& around = shares_around_[r];
  const auto count = static_cast<double>(around.size());
  const double now = time_s * moments_per_s_ - static_cast<double>(first_) +
                     (loop_ ? 0 : static_cast<double>(r + 1));
  for (std::size_t d = 0; d < shares.size(); ++d) {
    double at = std::floor(now - (static_cast<double>(d) + 0.5) / per_s * moments_per_s_);
    if (loop_) at -= std::floor(at / count) * count;
    shares[d] = at >= 0 && at < count ? around[static_cast<std::size_t>(at)] : BandShares();
  }
}

float LoudnessTrack::most_share(BandMix mix, double time_s, float delay_s, float give_s,
                                double ahead_s) const {
  const double at =
      (time_s - static_cast<double>(delay_s)) * moments_per_s_ - static_cast<double>(first_);
  const double rounds_s = 0x1p-24 * std::abs(static_cast<double>(delay_s));
  const double give = 1e-3 + (static_cast<double>(give_s) + rounds_s) * moments_per_s_;
  if (!(std::abs(at) + give < kNoMoment)) return mix.of(shares_of(most_));  // of a forged file
  const auto count = static_cast<std::int64_t>(by_moment_.size());
  auto first = static_cast<std::int64_t>(std::floor(at - give));
  auto last = static_cast<std::int64_t>(std::floor(at + give + ahead_s * moments_per_s_));
  if (loop_) {
    if (last - first >= count) return mix.of(shares_of(most_));
    const std::int64_t turns = (first >= 0 ? first : first - count + 1) / count;
    first -= turns * count;
    last -= turns * count;
  } else {
    first = std::max<std::int64_t>(first, 0);
    last = std::min(last, count - 1);
  }
  Bands most{};
  for (; first <= last; first = std::min((first / kFew + 1) * kFew, count)) {
    if (first >= count) {  // of a loop
      first -= count;
      last -= count;
    }
    raise(most, shares_of_few_[static_cast<std::size_t>(first / kFew)]);
  }
  return mix.of(most);
}

Bands LoudnessTrack::most_between(double from_s, double to_s) const {
  const auto count = static_cast<std::int64_t>(by_moment_.size());
  std::int64_t from = static_cast<std::int64_t>(std::floor(from_s * moments_per_s_)) - first_;
  std::int64_t to = static_cast<std::int64_t>(std::floor(to_s * moments_per_s_)) - first_;
  if (loop_) {
    if (to - from + 1 >= count) return most_;
    const std::int64_t round = (from >= 0 ? from / count : -((count - 1 - from) / count)) * count;
    from -= round;
    to -= round;
  } else {
    from = std::max<std::int64_t>(from, 0);
    to = std::min(to, count - 1);
  }
  Bands most{};
  while (from <= to) {
    const std::int64_t at = from % count;
    if (at % kStretch == 0 && from + kStretch - 1 <= to && at + kStretch <= count) {
      raise(most, most_of_stretch_[static_cast<std::size_t>(at / kStretch)]);
      from += kStretch;
    } else {
      raise(most, by_moment_[static_cast<std::size_t>(at)]);
      ++from;
    }
  }
  return most;
}

SignalWeights make_signal_weights(std::span<const TimedEnvelope> signals,
                                  const EnvelopeSmoothing& smoothing) {
  const Bands loudness = loudness_weights();
  SignalWeights weights;
  bool steady = true;
  for (const TimedEnvelope& signal : signals) {
    const LoudnessTrack& track = weights.tracks.emplace_back(signal.envelope, signal.frames,
                                                             signal.loop, loudness, smoothing);
    weights.by_signal.push_back(track.most());
    steady = steady && track.steady();
  }
  if (steady) weights.tracks.clear();
  return weights;
}

}  // namespace clamor
