#include "formats/level/signal_table.h"

#include <cmath>
#include <numbers>

#include "common/maths.h"
#include "common/random.h"
#include "common/sample_rate.h"

namespace clamor {

namespace {

// Filters white noise with shelves an octave apart, each a pole with a zero half an octave above
// it: a staircase that falls 3 dB per octave within 0.3 dB, as pink noise does. The second of two
// passes over the noise is kept, when the filters have settled, so the loop is seamless.
std::vector<float> pink_noise(std::size_t frames, double rms) {
  std::vector<double> samples(frames);
  for (std::size_t i = 0; i < frames; ++i)
    samples[i] = unit(philox(0x70696e6b, {static_cast<std::uint32_t>(i), 0, 0, 0})[0]) * 2 - 1;
  for (double pole_hz = 10; pole_hz < kSampleRate_hz / 2; pole_hz *= 2) {
    const double radians_per_hz = 2 * std::numbers::pi / kSampleRate_hz;
    const double pole = exp_of(-radians_per_hz * pole_hz);
    const double zero = exp_of(-radians_per_hz * pole_hz * std::numbers::sqrt2);
    double y = 0;
    for (int round = 0; round < 2; ++round) {
      double before = samples.back();
      std::vector<double> filtered(frames);
      for (std::size_t i = 0; i < frames; ++i) {
        y = pole * y + samples[i] - zero * before;
        before = samples[i];
        filtered[i] = y;
      }
      if (round == 1) samples = std::move(filtered);
    }
  }
  double mean = 0, power = 0;
  for (const double sample : samples) mean += sample / static_cast<double>(frames);
  for (double& sample : samples) sample -= mean;
  for (const double sample : samples) power += sample * sample / static_cast<double>(frames);
  std::vector<float> result(frames);
  for (std::size_t i = 0; i < frames; ++i)
    result[i] = static_cast<float>(samples[i] * rms / std::sqrt(power));
  return result;
}

}  // namespace

bool is_built_in_signal(std::string_view word) { return word == "impulse" || word == "noise"; }

std::vector<float> built_in_signal(std::string_view word) {
  if (word == "impulse") return {1.0f};
  return pink_noise(std::size_t{4} * kSampleRate_hz, 0.1);
}

std::optional<std::uint32_t> SignalTable::find(const std::string& key, bool loop) const {
  const auto it = known_.find({key, loop});
  if (it == known_.end()) return std::nullopt;
  return it->second;
}

std::uint32_t SignalTable::add(const std::string& key, std::string name, std::vector<float> samples,
                               bool loop) {
  const auto index = static_cast<std::uint32_t>(signals_.size());
  signals_.push_back({std::move(name), std::move(samples), loop});
  known_[{key, loop}] = index;
  return index;
}

std::uint32_t SignalTable::built_in(const std::string& word, bool loop) {
  if (const auto known = find("built in " + word, loop)) return *known;
  return add("built in " + word, word, built_in_signal(word), loop);
}

}  // namespace clamor
