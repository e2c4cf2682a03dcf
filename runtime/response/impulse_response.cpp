#include "runtime/response/impulse_response.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "common/sample_rate.h"
#include "runtime/response/octave_filter.h"

namespace clamor {

namespace {

// A pulse between samples: a sinc under a Kaiser window, tabulated at kPhases fractions of a sample
// and linear between them, which is exact to -100 dB.
class PulseTable {
 public:
  static constexpr int kTaps = 32;
  static constexpr int kBefore = kTaps / 2 - 1;  // taps before the sample that the pulse follows

  PulseTable() : taps_((kPhases + 1) * kTaps) {
    for (int phase = 0; phase <= kPhases; ++phase)
      for (int tap = 0; tap < kTaps; ++tap) {
        const double x = tap - kBefore - static_cast<double>(phase) / kPhases;
        const double sinc = x == 0 ? 1 : std::sin(std::numbers::pi * x) / (std::numbers::pi * x);
        const double edge = 1 - std::pow(x / (kTaps / 2), 2);
        const double window = edge > 0 ? bessel_i0(kBeta * std::sqrt(edge)) / bessel_i0(kBeta) : 0;
        // At whole samples the pulse is exactly one sample of 1, without rounding residue of
        // sin(pi).
        const bool whole = phase == 0 || phase == kPhases;
        taps_[phase * kTaps + tap] = whole ? (std::abs(x) < 0.5 ? 1 : 0) : sinc * window;
      }
  }

  std::array<double, kTaps> taps(double fraction) const {
    const double position = fraction * kPhases;
    const auto phase = static_cast<std::size_t>(position);
    const double t = position - static_cast<double>(phase);
    const double *low = &taps_[phase * kTaps], *high = low + kTaps;
    std::array<double, kTaps> result;
    for (int tap = 0; tap < kTaps; ++tap) result[tap] = low[tap] + t * (high[tap] - low[tap]);
    return result;
  }

 private:
  static constexpr int kPhases = 1024;
  static constexpr double kBeta = 8;

  static double bessel_i0(double x) {
    double sum = 1, term = 1;
    for (int k = 1; term > 1e-17 * sum; ++k) {
      term *= (x / (2 * k)) * (x / (2 * k));
      sum += term;
    }
    return sum;
  }

  std::vector<double> taps_;
};

}  // namespace

std::size_t first_response_frame(std::span<const Arrival> arrivals) {
  if (arrivals.empty() || !(arrivals.front().time_s > kMaxSilence_s)) return 0;
  return static_cast<std::size_t>(arrivals.front().time_s * kSampleRate_hz);
}

std::size_t whole_response_frames(std::span<const Arrival> arrivals) {
  constexpr double kRinging_s = 0.05;  // of the lowest band
  if (arrivals.empty()) return 0;
  const double last = (arrivals.back().time_s + kRinging_s) * kSampleRate_hz;
  const double frames = last - static_cast<double>(first_response_frame(arrivals));
  return static_cast<std::size_t>(std::min(frames, kMaxResponse_s * kSampleRate_hz)) + 1;
}

void write_impulse_response(std::span<const Arrival> arrivals, std::size_t first,
                            std::span<float> response) {
  std::ranges::fill(response, 0.0f);
  if (arrivals.empty()) return;
  // The part that sounds, with the ringing of filters before and after it.
  const auto frame_at = [&](double time_s, double ring) {
    const double frame = std::floor(time_s * kSampleRate_hz) + ring - static_cast<double>(first);
    return static_cast<std::size_t>(std::clamp(frame, 0.0, static_cast<double>(response.size())));
  };
  const std::size_t begin = frame_at(arrivals.front().time_s, -double{kOctaveRing});
  const std::size_t count = frame_at(arrivals.back().time_s, kOctaveRing) - begin;
  if (count == 0) return;
  const PulseTable pulses;
  // Padding on both sides for the taps of the first and the last pulse.
  std::array<std::vector<double>, kBandCount> bands;
  for (auto& band : bands) band.assign(count + PulseTable::kTaps, 0);
  for (const Arrival& arrival : arrivals) {
    const double position = arrival.time_s * kSampleRate_hz - static_cast<double>(first + begin);
    if (!(position >= 0 && position < static_cast<double>(count))) continue;
    const auto whole = static_cast<std::size_t>(position);
    const auto taps = pulses.taps(position - static_cast<double>(whole));
    for (std::size_t b = 0; b < kBandCount; ++b) {
      const double amplitude = arrival.polarity * std::sqrt(static_cast<double>(arrival.energy[b]));
      double* const out = &bands[b][whole];  // kBefore samples early, like the whole array
      for (int tap = 0; tap < PulseTable::kTaps; ++tap) out[tap] += amplitude * taps[tap];
    }
  }
  const std::vector<double> sum = sum_of_bands(bands);
  std::copy_n(sum.begin() + PulseTable::kBefore, count,
              response.begin() + static_cast<std::ptrdiff_t>(begin));
}

std::vector<float> impulse_response(std::span<const Arrival> arrivals, std::size_t frames,
                                    std::size_t first) {
  std::vector<float> response(frames);
  write_impulse_response(arrivals, first, response);
  return response;
}

}  // namespace clamor
