#include "runtime/signal_bank.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "common/crossover.h"
#include "runtime/octave_bank.h"

namespace clamor {

namespace {

// A spline's prefilter is forgotten in so many samples: 0.268^64 is beyond doubles.
constexpr int kSplineTail = 64;

// Samples to half the coefficients of the cubic B-spline through them: 3 / (z + 4 + 1 / z), its
// stable half forwards and the other backwards.
void to_spline(std::vector<double>& samples, bool loop) {
  const double pole = std::sqrt(3.0) - 2;
  const std::size_t tail = loop ? std::size_t{kSplineTail} : 0;
  filter_samples({Biquad{1, 0, 0, -pole, 0}}, samples, false, tail);
  filter_samples({Biquad{-3 * pole, 0, 0, -pole, 0}}, samples, true, tail);
}

// `samples` from -guard to size + guard: silence there, or what a loop plays. A loop may come round
// only after several of its lengths; `size` is of one.
std::vector<float> guarded(const std::vector<double>& samples, std::size_t size, std::size_t guard,
                           bool loop) {
  std::vector<float> result(size + 2 * guard, 0.0f);
  const auto period = static_cast<std::int64_t>(samples.size());
  for (std::size_t i = 0; i < result.size() && period > 0; ++i) {
    const std::int64_t at = static_cast<std::int64_t>(i) - static_cast<std::int64_t>(guard);
    if (loop)
      result[i] =
          static_cast<float>(samples[static_cast<std::size_t>((at % period + period) % period)]);
    else if (at >= 0 && at < period)
      result[i] = static_cast<float>(samples[static_cast<std::size_t>(at)]);
  }
  return result;
}

}  // namespace

PreparedSignal::PreparedSignal(const Signal& signal, const MixMode& mode) {
  std::vector<double> samples(signal.samples.begin(), signal.samples.end());
  for (double& sample : samples)
    if (!std::isfinite(sample)) {
      sample = 0;
      ++bad_samples_;
    }
  const bool loop = signal.loop && !samples.empty();
  const std::size_t once = samples.size();
  while (loop && samples.size() < kReach)
    samples.insert(samples.end(), samples.end() - static_cast<std::ptrdiff_t>(once), samples.end());
  if (loop) loop_frames_ = static_cast<std::int64_t>(samples.size());
  OctaveBank::Layers layers = OctaveBank::part(samples, loop, !mode.head);
  mean_square_ = layers.mean_square;
  if (!mode.two_layers()) {
    layers.low.clear();
    layers.high = std::move(samples);
    if (!loop) {  // a spline reaches beyond its samples on both sides
      layers.high.insert(layers.high.begin(), kSplineTail, 0.0);
      layers.high.resize(layers.high.size() + kSplineTail);
    }
  }
  if (!loop) front_frames_ = mode.two_layers() ? kBankTailFrames : kSplineTail;
  end_frames_ = static_cast<std::int64_t>(layers.high.size()) - front_frames_ + 2;

  if (mode.interpolation == Interpolation::kCubic) to_spline(layers.high, loop);
  to_spline(layers.low, loop);

  high_ = guarded(layers.high, layers.high.size(), kGuardFrames, loop);
  const std::size_t low_size =
      loop ? (layers.high.size() + kLowRate - 1) / kLowRate : layers.low.size();
  low_ = guarded(layers.low, mode.two_layers() ? low_size : 0, kGuardFrames / kLowRate, loop);
}

std::int64_t PreparedSignal::near(std::int64_t frame) const noexcept REALTIME {
  // Three hours: no voice is held for so long.
  constexpr std::int64_t kFar = std::int64_t{1} << 29;
  if (loop_frames_ > 0) return frame % loop_frames_;
  return std::clamp(frame, -kFar, end_frames_ + kFar);
}

const float* PreparedSignal::silence() noexcept REALTIME {
  static constexpr std::array<float, 2 * kGuardFrames> kSilence{};
  return kSilence.data() + kGuardFrames / 4;
}

std::vector<PreparedSignal> prepare_signals(std::span<const Signal> signals, const MixMode& mode) {
  std::vector<PreparedSignal> prepared;
  prepared.reserve(signals.size());
  for (const Signal& signal : signals) prepared.emplace_back(signal, mode);
  return prepared;
}

}  // namespace clamor
