#include "runtime/voices/octave_filter_bank.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <memory>
#include <numbers>
#include <numeric>

#include "common/crossover.h"
#include "common/sample_rate.h"

namespace clamor {

namespace {

constexpr std::size_t kParting = kLowBands - 1;  // the edge between the layers
constexpr double kLowRate_hz = static_cast<double>(kSampleRate_hz) / kLowRate;

// The side of an edge that a band takes in its layer's tree: {5 | {6 | 7}} and {{0 | 1} | {{2 | 3}
// | 4}}.
Side side_of(std::size_t band, std::size_t edge) {
  static_assert(kBandCount == 8, "edges 0 to 6");
  const bool on_way = edge == 5 || (edge == 6 && band >= 6) || edge == 1 ||
                      (edge == 0 && band <= 1) || (edge == 3 && band >= 2) ||
                      (edge == 2 && (band == 2 || band == 3));
  if (!on_way) return Side::kBoth;
  return band <= edge ? Side::kLow : Side::kHigh;
}

struct Layer {
  std::size_t first_edge, end_edge;
  double rate_hz;
};
constexpr Layer kHighLayer{kParting + 1, kBandEdges, kSampleRate_hz};
constexpr Layer kLowLayer{0, kParting, kLowRate_hz};

// All sections of a band. One side of a crossover is a Butterworth filter applied twice.
std::vector<Biquad> sections_of(std::size_t band) {
  const Layer& layer = band <= kParting ? kLowLayer : kHighLayer;
  std::vector<Biquad> sections;
  for (std::size_t edge = layer.first_edge; edge < layer.end_edge; ++edge) {
    const Side side = side_of(band, edge);
    for (int times = 0; times < (side == Side::kBoth ? 1 : 2); ++times)
      for (const Biquad& factor : crossover_factors(edge, layer.rate_hz, side))
        sections.push_back(factor);
  }
  return sections;
}

std::vector<Biquad> all_pass_of(const Layer& layer) {
  std::vector<Biquad> sections;
  for (std::size_t edge = layer.first_edge; edge < layer.end_edge; ++edge)
    for (const Biquad& factor : crossover_factors(edge, layer.rate_hz, Side::kBoth))
      sections.push_back(factor);
  return sections;
}

template <class Cascade>
void set_lanes(Cascade& cascade, std::size_t first_band, std::size_t bands) {
  cascade = Cascade{};
  for (auto& section : cascade.section) std::fill_n(section.b0, Cascade::kLanes, 1.0);
  for (std::size_t b = 0; b < bands; ++b) {
    const std::vector<Biquad> sections = sections_of(first_band + b);
    assert(sections.size() <= Cascade::kSections);
    for (int ear = 0; ear < kEars; ++ear)
      for (std::size_t k = 0; k < sections.size(); ++k) {
        const int lane = band_lane(b, ear);
        cascade.section[k].b0[lane] = sections[k].b0;
        cascade.section[k].b1[lane] = sections[k].b1;
        cascade.section[k].b2[lane] = sections[k].b2;
        cascade.section[k].a1[lane] = sections[k].a1;
        cascade.section[k].a2[lane] = sections[k].a2;
      }
  }
}

// The modified Bessel function of order 0, by its power series.
double bessel_i0(double x) {
  double sum = 1, term = 1;
  for (int k = 1; k < 60; ++k) sum += term *= x * x / (4.0 * k * k);
  return sum;
}

// Filters rows of buses and adds up the bands of an ear into sum[ear][before + frame].
template <class Cascade, int kFrames, std::size_t kSum>
void filter_and_add(Cascade& cascade, const float* rows, int bands, int frames, std::size_t before,
                    double (&sum)[kEars][kSum]) {
  alignas(64) double lanes[kFrames * Cascade::kLanes];
  for (int f = 0; f < frames; ++f) {
    double* frame = lanes + f * Cascade::kLanes;
    for (int row = 0; row < bands * kEars; ++row) frame[row] = rows[row * kFrames + f];
    std::fill(frame + bands * kEars, frame + Cascade::kLanes, 0.0);
  }
  filter_lanes(cascade, lanes, frames);
  for (int f = 0; f < frames; ++f)
    for (int ear = 0; ear < kEars; ++ear) {
      double all = 0;
      for (int b = 0; b < bands; ++b)
        all += lanes[f * Cascade::kLanes + band_lane(static_cast<std::size_t>(b), ear)];
      sum[ear][before + static_cast<std::size_t>(f)] = all;
    }
}

// Mean square of what each lane passes of a layer, scaled. The layer has been playing for `tail`
// frames before.
template <class Cascade>
void add_squares(const std::vector<double>& layer, std::size_t first_band, std::size_t bands,
                 std::size_t tail, double scale, Bands& mean_square) {
  const auto cascade = std::make_unique<Cascade>();
  set_lanes(*cascade, first_band, bands);
  alignas(64) double lanes[kStepFrames * Cascade::kLanes];
  std::array<double, kBandCount> sum{};
  const std::size_t size = layer.size(), skipped = (size - tail % size) % size;
  for (std::size_t first = 0; first < tail + size; first += kStepFrames) {
    const std::size_t frames = std::min<std::size_t>(kStepFrames, tail + size - first);
    for (std::size_t f = 0; f < frames; ++f)
      std::fill_n(lanes + f * Cascade::kLanes, Cascade::kLanes,
                  layer[(skipped + first + f) % size]);
    filter_lanes(*cascade, lanes, static_cast<int>(frames));
    for (std::size_t f = first < tail ? std::min(tail - first, frames) : 0; f < frames; ++f)
      for (std::size_t b = 0; b < bands; ++b) {
        const double y = lanes[f * Cascade::kLanes + static_cast<std::size_t>(band_lane(b, 0))];
        sum[b] += y * y;
      }
  }
  for (std::size_t b = 0; b < bands; ++b)
    mean_square[first_band + b] = static_cast<float>(sum[b] * scale);
}

}  // namespace

// The ideal low-pass at half the low rate under a Kaiser window: 100 dB, flat to 2.8 kHz, where the
// low layer is 50 dB down.
double OctaveFilterBank::up_tap(int k) {
  constexpr double kBeta = 10.06;
  const double x = static_cast<double>(k - kBankDelayFrames) / kLowRate;
  const double r = static_cast<double>(k - kBankDelayFrames) / (kBankDelayFrames + 1);
  const double sinc = x == 0 ? 1 : std::sin(std::numbers::pi * x) / (std::numbers::pi * x);
  return sinc * bessel_i0(kBeta * std::sqrt(1 - r * r)) / bessel_i0(kBeta);
}

OctaveFilterBank::OctaveFilterBank() {
  set_lanes(high_, kLowBands, kHighBands);
  set_lanes(low_, 0, kLowBands);
  for (int k = 0; k < kTaps; ++k) up_[static_cast<std::size_t>(k)] = up_tap(k);
}

void OctaveFilterBank::process(const MixBuses& buses, int frames, float* interleaved,
                               int stride) noexcept REALTIME {
  assert(frames % kStepFrames == 0 && frames <= kMaxFrames);
  const int low_frames = frames / kLowRate;
  filter_and_add<HighCascade, kMaxFrames>(high_, buses.high, kHighBands, frames, kBankDelayFrames,
                                          high_sum_);
  filter_and_add<LowCascade, kMaxFrames / kLowRate>(low_, buses.low, kLowBands, low_frames,
                                                    kLowHistory, low_sum_);
  for (int ear = 0; ear < kEars; ++ear) {
    double* const low = low_sum_[ear];
    double* const high = high_sum_[ear];
    for (int f = 0; f < frames; ++f) {
      double sum = high[f];
      for (int k = f % kLowRate, at = kLowHistory + f / kLowRate; k < kTaps; k += kLowRate, --at)
        sum += up_[static_cast<std::size_t>(k)] * low[at];
      interleaved[f * stride + ear] = static_cast<float>(sum);
    }
    std::copy_n(low + low_frames, kLowHistory, low);
    std::copy_n(high + frames, kBankDelayFrames, high);
  }
}

double OctaveFilterBank::magnitude(std::size_t band, double frequency_hz) {
  const bool is_low = band <= kParting;
  const Layer& layer = is_low ? kLowLayer : kHighLayer;
  double magnitude = crossover_magnitude(kParting, kSampleRate_hz,
                                         is_low ? Side::kLow : Side::kHigh, frequency_hz);
  if (frequency_hz >= layer.rate_hz / 2) return 0;
  for (std::size_t edge = layer.first_edge; edge < layer.end_edge; ++edge)
    magnitude *= crossover_magnitude(edge, layer.rate_hz, side_of(band, edge), frequency_hz);
  return magnitude;
}

const std::array<std::array<double, kBandCount>, kBandCount>& OctaveFilterBank::bus_gains() {
  static const auto kInverse = [] {
    // Gauss-Jordan elimination without pivoting; the diagonal dominates by far.
    std::array<std::array<double, kBandCount>, kBandCount> m{}, inverse{};
    for (std::size_t c = 0; c < kBandCount; ++c) {
      inverse[c][c] = 1;
      for (std::size_t b = 0; b < kBandCount; ++b) m[c][b] = magnitude(b, kBandCentres_hz[c]);
    }
    for (std::size_t i = 0; i < kBandCount; ++i) {
      const double pivot = m[i][i];
      for (std::size_t k = 0; k < kBandCount; ++k) m[i][k] /= pivot, inverse[i][k] /= pivot;
      for (std::size_t j = 0; j < kBandCount; ++j) {
        if (j == i) continue;
        const double times = m[j][i];
        for (std::size_t k = 0; k < kBandCount; ++k) {
          m[j][k] -= times * m[i][k];
          inverse[j][k] -= times * inverse[i][k];
        }
      }
    }
    return inverse;
  }();
  return kInverse;
}

namespace {

// Splits in place: `whole` keeps the high layer, and the low layer is returned at the full rate.
std::vector<double> part_in_place(std::vector<double>& whole, std::size_t tail) {
  const auto butterworth = crossover_factors(kParting, kSampleRate_hz, Side::kLow);
  const std::vector<Biquad> low_pass(butterworth.begin(), butterworth.end());
  std::vector<double> low = whole;
  filter_samples(low_pass, low, false, tail);
  filter_samples(low_pass, low, true, tail);
  for (std::size_t i = 0; i < low.size(); ++i) whole[i] -= low[i];
  return low;
}

}  // namespace

OctaveFilterBank::Layers OctaveFilterBank::part(const std::vector<double>& samples, bool loop,
                                                bool phase_undone, bool powers) {
  Layers layers;
  if (samples.empty()) return layers;
  layers.high = samples;
  if (!loop) {
    layers.high.insert(layers.high.begin(), kBankTailFrames, 0.0);
    layers.high.resize(layers.high.size() + kPartingTailFrames);
  }
  const auto tail = [&](int frames) { return loop ? static_cast<std::size_t>(frames) : 0; };
  const std::vector<double> low = part_in_place(layers.high, tail(kPartingTailFrames));

  std::size_t count = (low.size() + kLowRate - 1) / kLowRate;
  if (loop)  // once round in steps of kLowRate
    count = low.size() / std::gcd(low.size(), std::size_t{kLowRate});
  for (std::size_t k = 0; k < count; ++k) layers.low.push_back(low[kLowRate * k % low.size()]);

  // Power is independent of phase, so it is measured before the phase is undone.
  if (powers) {
    const auto frames = static_cast<double>(samples.size());
    add_squares<HighCascade>(layers.high, kLowBands, kHighBands, tail(kBankTailFrames), 1 / frames,
                             layers.mean_square);
    const double low_frames = loop ? static_cast<double>(layers.low.size()) : frames / kLowRate;
    add_squares<LowCascade>(layers.low, 0, kLowBands, tail(kBankTailFrames / kLowRate),
                            1 / low_frames, layers.mean_square);
  }

  if (!phase_undone) return layers;
  filter_samples(all_pass_of(kHighLayer), layers.high, true, tail(kBankTailFrames));
  filter_samples(all_pass_of(kLowLayer), layers.low, true, tail(kBankTailFrames / kLowRate));
  return layers;
}

OctaveFilterBank::Layers OctaveFilterBank::part_window(std::vector<double> window,
                                                       bool phase_undone) {
  Layers layers;
  layers.high = std::move(window);
  const std::vector<double> low = part_in_place(layers.high, 0);
  for (std::size_t i = 0; i < low.size(); i += kLowRate) layers.low.push_back(low[i]);
  if (!phase_undone) return layers;
  filter_samples(all_pass_of(kHighLayer), layers.high, true, 0);
  filter_samples(all_pass_of(kLowLayer), layers.low, true, 0);
  return layers;
}

}  // namespace clamor
