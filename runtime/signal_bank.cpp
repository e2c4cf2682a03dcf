#include "runtime/signal_bank.h"

#include <array>
#include <cmath>

namespace clamor {

PreparedSignal::PreparedSignal(const Signal& signal)
    : length_(static_cast<std::int64_t>(signal.samples.size())), loop_(signal.loop) {
  std::vector<float> clean = signal.samples;
  for (float& sample : clean)
    if (!std::isfinite(sample)) {
      sample = 0;
      ++bad_samples_;
    }
  mean_square_ = OctaveBank::mean_squares(clean);

  std::vector<double> samples(clean.begin(), clean.end());
  OctaveBank::undo_phase(samples, loop_);
  const std::size_t size = samples.size();
  samples_.assign(size + 2 * static_cast<std::size_t>(kGuardFrames), 0.0f);
  for (std::size_t i = 0; i < size; ++i)
    samples_[kGuardFrames + i] = static_cast<float>(samples[i]);
  if (!loop_ || size == 0) return;
  for (std::size_t i = 0; i < static_cast<std::size_t>(kGuardFrames); ++i) {
    samples_[kGuardFrames + size + i] = samples_[kGuardFrames + i % size];
    samples_[kGuardFrames - 1 - i] = samples_[kGuardFrames + size - 1 - i % size];
  }
}

const float* PreparedSignal::silence() noexcept REALTIME {
  static constexpr std::array<float, 2 * kGuardFrames> kSilence{};
  return kSilence.data() + kGuardFrames;
}

std::vector<PreparedSignal> prepare_signals(std::span<const Signal> signals) {
  std::vector<PreparedSignal> prepared;
  prepared.reserve(signals.size());
  for (const Signal& signal : signals) prepared.emplace_back(signal);
  return prepared;
}

}  // namespace clamor
