// test_sounds.h: sounds with known properties.
#pragma once

#include <cmath>
#include <cstdint>
#include <numbers>
#include <vector>

#include "common/random.h"
#include "common/sample_rate.h"
#include "formats/audio/audio_file.h"

namespace clamor::testing {

inline std::size_t frames_of(double seconds) {
  return static_cast<std::size_t>(std::lround(seconds * kSampleRate_hz));
}

inline std::vector<float> sine(double frequency_hz, double amplitude, double seconds) {
  std::vector<float> samples(frames_of(seconds));
  for (std::size_t i = 0; i < samples.size(); ++i)
    samples[i] = static_cast<float>(amplitude * std::sin(2 * std::numbers::pi * frequency_hz *
                                                         static_cast<double>(i) / kSampleRate_hz));
  return samples;
}

// Applies a sin^2 window, so that no other frequencies appear at the ends. The energy becomes 3/8.
inline std::vector<float> swelling(std::vector<float> samples) {
  for (std::size_t i = 0; i < samples.size(); ++i)
    samples[i] *= static_cast<float>(std::pow(
        std::sin(std::numbers::pi * static_cast<double>(i) / static_cast<double>(samples.size())),
        2));
  return samples;
}

// White Gaussian noise with standard deviation sigma.
inline std::vector<float> noise(std::uint64_t seed, double sigma, double seconds) {
  std::vector<float> samples(frames_of(seconds));
  for (std::size_t i = 0; i < samples.size(); ++i) {
    const RandomBits bits = philox(seed, {static_cast<std::uint32_t>(i), 0, 0, 0});
    samples[i] = static_cast<float>(sigma * std::sqrt(-2 * std::log(unit_above_zero(bits[0]))) *
                                    std::cos(2 * std::numbers::pi * unit(bits[1])));
  }
  return samples;
}

// White noise that falls by 60 dB in decay_s, starting at 10 ms.
inline std::vector<float> decaying(std::uint64_t seed, double decay_s, double seconds) {
  auto samples = noise(seed, 1, seconds);
  for (std::size_t i = 0; i < samples.size(); ++i)
    samples[i] *= static_cast<float>(
        i < 480 ? 0 : std::pow(10, -3 * (static_cast<double>(i) - 480) / 48000 / decay_s));
  return samples;
}

inline std::vector<float> times(std::vector<float> samples, double gain) {
  for (float& x : samples) x = static_cast<float>(gain * x);
  return samples;
}

inline std::vector<float> plus(std::vector<float> a, const std::vector<float>& b) {
  for (std::size_t i = 0; i < a.size(); ++i) a[i] += b[i];
  return a;
}

// Delays by a whole number of frames; what exceeds the end is lost.
inline std::vector<float> later(const std::vector<float>& samples, std::size_t frames) {
  std::vector<float> result(samples.size());
  for (std::size_t i = frames; i < samples.size(); ++i) result[i] = samples[i - frames];
  return result;
}

inline Sound mono(std::vector<float> samples) { return {{std::move(samples)}, kSampleRate_hz}; }
inline Sound stereo(std::vector<float> left, std::vector<float> right) {
  return {{std::move(left), std::move(right)}, kSampleRate_hz};
}

}  // namespace clamor::testing
