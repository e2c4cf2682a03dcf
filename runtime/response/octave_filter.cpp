#include "runtime/response/octave_filter.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <numbers>

#include "common/sample_rate.h"

namespace clamor {

namespace {

constexpr int kMixerOrder = 4, kOctaveOrder = 6;

// One pair of poles of a Butterworth low-pass, by the bilinear transform.
struct Biquad {
  double gain, a1, a2;

  Biquad(double edge_hz, int order, int pair) {
    const double w = std::tan(std::numbers::pi * edge_hz / kSampleRate_hz);
    const double damping = 2 * std::sin(std::numbers::pi * (2 * pair + 1) / (2 * order));
    const double scale = 1 / (1 + damping * w + w * w);
    gain = w * w * scale;
    a1 = 2 * (w * w - 1) * scale;
    a2 = (1 - damping * w + w * w) * scale;
  }

  // Filters in place; transposed direct form II, whose state stays small at low edges.
  template <class Iterator>
  void run(Iterator first, Iterator last) const {
    double s1 = 0, s2 = 0;
    for (; first != last; ++first) {
      const double x = gain * *first;
      const double y = x + s1;
      s1 = 2 * x - a1 * y + s2;
      s2 = x - a2 * y;
      *first = y;
    }
  }
};

// 1 / (1 + (w / w_e)^2n). Ringing beyond the ends of `signal` is lost, so pad it first.
void low_pass(std::vector<double>& signal, double edge_hz, int order) {
  assert(order % 2 == 0 && edge_hz < kSampleRate_hz / 2.0);
  for (int pair = 0; pair < order / 2; ++pair) {
    const Biquad biquad(edge_hz, order, pair);
    biquad.run(signal.begin(), signal.end());
    biquad.run(signal.rbegin(), signal.rend());
  }
}

std::vector<double> padded(std::span<const double> signal) {
  std::vector<double> result(signal.size() + 2 * kOctaveRing);
  std::copy(signal.begin(), signal.end(), result.begin() + kOctaveRing);
  return result;
}

double octave_edge_hz(std::size_t band, double octaves) {
  return 1000 * std::pow(10.0, 0.3 * (static_cast<double>(band) - 4 + octaves));
}

// Edges lie slightly further apart than an octave, so that they are 3 dB down and not 6.
double outwards() { return std::pow(std::numbers::sqrt2 - 1, -1.0 / (2 * kOctaveOrder)); }

}  // namespace

double band_edge_hz(std::size_t below, std::size_t above) {
  return std::sqrt(kBandCentres_hz[below] * kBandCentres_hz[above]);
}

std::vector<double> sum_of_bands(const std::array<std::vector<double>, kBandCount>& bands) {
  // sum of (L_{b+1} - L_b) x_b  =  x_7 + sum of L_b (x_{b-1} - x_b): equal bands cancel.
  std::vector<double> sum = bands.back();
  std::vector<double> difference(sum.size());
  for (std::size_t b = 1; b < kBandCount; ++b) {
    assert(bands[b].size() == sum.size());
    for (std::size_t i = 0; i < sum.size(); ++i) difference[i] = bands[b - 1][i] - bands[b][i];
    std::vector<double> low = padded(difference);
    low_pass(low, band_edge_hz(b - 1, b), kMixerOrder);
    for (std::size_t i = 0; i < sum.size(); ++i) sum[i] += low[i + kOctaveRing];
  }
  return sum;
}

std::vector<double> octave_of(std::span<const double> signal, std::size_t band) {
  std::vector<double> octave = padded(signal);
  low_pass(octave, octave_edge_hz(band, 0.5) * outwards(), kOctaveOrder);
  std::vector<double> below = octave;
  low_pass(below, octave_edge_hz(band, -0.5) / outwards(), kOctaveOrder);
  for (std::size_t i = 0; i < octave.size(); ++i) octave[i] -= below[i];
  return octave;
}

double octave_gain(std::size_t band, double frequency_hz) {
  const auto low = [&](double edge_hz) {
    const double w = std::tan(std::numbers::pi * frequency_hz / kSampleRate_hz);
    const double w_edge = std::tan(std::numbers::pi * edge_hz / kSampleRate_hz);
    return 1 / (1 + std::pow(w / w_edge, 2 * kOctaveOrder));
  };
  return low(octave_edge_hz(band, 0.5) * outwards()) *
         (1 - low(octave_edge_hz(band, -0.5) / outwards()));
}

double octave_width_hz(std::size_t band) {
  return octave_edge_hz(band, 0.5) - octave_edge_hz(band, -0.5);
}

}  // namespace clamor
