#include "runtime/field/signal_weights.h"

#include <algorithm>
#include <cmath>

#include "runtime/field/loudness.h"

namespace clamor {

namespace {

void raise(Bands& most, const Bands& to) {
  for (std::size_t b = 0; b < kBandCount; ++b) most[b] = std::max(most[b], to[b]);
}

constexpr float kRoundedUp = 1.0001f;  // a bound must never be too low

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
    float share = 0;
    for (std::size_t b = 0; b < kBandCount; ++b)
      if (most_[b] > 0) share = std::max(share, moment[b] / most_[b]);
    shares_.push_back(share * kRoundedUp);
  }
  for (std::size_t m = 0; m < shares_.size(); ++m) {
    if (m % kFew == 0) shares_of_few_.push_back(0);
    shares_of_few_.back() = std::max(shares_of_few_.back(), shares_[m]);
  }
  steady_ = loop && std::all_of(by_moment_.begin(), by_moment_.end(),
                                [&](const Bands& moment) { return moment == most_; });
}

LoudnessTrack::Seen LoudnessTrack::seen_at(double time_s) const {
  Seen seen;
  seen.shares_ = shares_.data();
  seen.of_few_ = shares_of_few_.data();
  seen.most_ = kRoundedUp;
  seen.count_ = static_cast<std::int64_t>(shares_.size());
  seen.moments_per_s_ = moments_per_s_;
  seen.loop_ = loop_;
  seen.round_ = loop_ ? static_cast<double>(seen.count_) : 0;
  seen.last_ = static_cast<double>(std::min<std::int64_t>(seen.count_ - 1, 1 << 30));
  seen.now_ = time_s * moments_per_s_ - static_cast<double>(first_);
  // Then most delays stay within one turn.
  if (loop_)
    seen.now_ -=
        std::floor(seen.now_ / static_cast<double>(seen.count_)) * static_cast<double>(seen.count_);
  return seen;
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
