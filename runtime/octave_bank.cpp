#include "runtime/octave_bank.h"

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <numbers>

#include "formats/level.h"

namespace clamor {

namespace {

constexpr double kPi = std::numbers::pi;
constexpr std::size_t kEdges = kBandCount - 1;  // edge k lies between bands k and k + 1

struct Biquad {
  double b0, b1, b2, a1, a2;
};

enum class Side { kLow, kHigh, kBoth };

double edge_hz(std::size_t edge) {
  return std::sqrt(kBandCentres_hz[edge] * kBandCentres_hz[edge + 1]);
}

double warped(double frequency_hz) { return std::tan(kPi * frequency_hz / kSampleRate_hz); }

// One second-order factor of a Butterworth crossover: 1, s^2 or s^2 - s/Q + 1 over s^2 + s/Q + 1,
// through the bilinear transform, exact at the edge.
Biquad crossover_factor(double frequency_hz, double q, Side side) {
  const double k = warped(frequency_hz);
  const double scale = 1 / (1 + k / q + k * k);
  const double a1 = 2 * (k * k - 1) * scale, a2 = (1 - k / q + k * k) * scale;
  switch (side) {
    case Side::kLow:
      return {k * k * scale, 2 * k * k * scale, k * k * scale, a1, a2};
    case Side::kHigh:
      return {scale, -2 * scale, scale, a1, a2};
    case Side::kBoth:
      break;
  }
  return {a2, a1, 1, a1, a2};
}

const std::array<double, 2> kButterworth_q = {1 / (2 * std::cos(kPi / 8)),
                                              1 / (2 * std::cos(3 * kPi / 8))};

// The crossovers of a balanced tree that lie on a band's way: 3, then 1 or 5, then one of 0 2 4 6.
bool on_path(std::size_t band, std::size_t edge) {
  return edge == 3 || edge == (band < 4 ? 1u : 5u) || edge == band / 2 * 2;
}

// All sections of a band, sides first and all-passes after.
std::array<Biquad, kBankSections> sections_of(std::size_t band) {
  std::array<Biquad, kBankSections> sections;
  std::size_t count = 0;
  for (std::size_t edge = 0; edge < kEdges; ++edge)
    if (on_path(band, edge))
      for (int twice = 0; twice < 2; ++twice)
        for (const double q : kButterworth_q)
          sections[count++] =
              crossover_factor(edge_hz(edge), q, band <= edge ? Side::kLow : Side::kHigh);
  for (std::size_t edge = 0; edge < kEdges; ++edge)
    if (!on_path(band, edge))
      for (const double q : kButterworth_q)
        sections[count++] = crossover_factor(edge_hz(edge), q, Side::kBoth);
  assert(count == kBankSections);
  return sections;
}

// A itself; run over time-reversed frames it is A backwards in time, which is 1 / A.
class AllPass {
 public:
  AllPass() {
    for (std::size_t edge = 0; edge < kEdges; ++edge)
      for (const double q : kButterworth_q)
        sections_.push_back(crossover_factor(edge_hz(edge), q, Side::kBoth));
    memory_.resize(sections_.size());
  }

  double next(double x) {
    for (std::size_t k = 0; k < sections_.size(); ++k) {
      const Biquad& section = sections_[k];
      auto& [s1, s2] = memory_[k];
      const double y = section.b0 * x + s1;
      s1 = section.b1 * x - section.a1 * y + s2;
      s2 = section.b2 * x - section.a2 * y;
      x = y;
    }
    return x;
  }

 private:
  std::vector<Biquad> sections_;
  std::vector<std::array<double, 2>> memory_;
};

}  // namespace

OctaveBank::OctaveBank() : cascade_{} {
  for (std::size_t band = 0; band < kBandCount; ++band) {
    const auto sections = sections_of(band);
    for (int ear = 0; ear < kEars; ++ear) {
      const int lane = bus_lane(band, ear);
      for (int k = 0; k < kBankSections; ++k) {
        cascade_.section[k].b0[lane] = sections[k].b0;
        cascade_.section[k].b1[lane] = sections[k].b1;
        cascade_.section[k].b2[lane] = sections[k].b2;
        cascade_.section[k].a1[lane] = sections[k].a1;
        cascade_.section[k].a2[lane] = sections[k].a2;
      }
    }
  }
}

void OctaveBank::process(const float* bus, int frames, float* interleaved) noexcept REALTIME {
  assert(frames <= kStepFrames);
  alignas(64) double lanes[kStepFrames * kBusLanes];
  for (int i = 0; i < frames * kBusLanes; ++i) lanes[i] = bus[i];
  filter_lanes(cascade_, lanes, frames);
  for (int f = 0; f < frames; ++f)
    for (int ear = 0; ear < kEars; ++ear) {
      double sum = 0;
      for (std::size_t band = 0; band < kBandCount; ++band)
        sum += lanes[f * kBusLanes + bus_lane(band, ear)];
      interleaved[f * kEars + ear] = static_cast<float>(sum);
    }
}

double OctaveBank::magnitude(std::size_t band, double frequency_hz) {
  double magnitude = 1;
  for (std::size_t edge = 0; edge < kEdges; ++edge)
    if (on_path(band, edge)) {
      const double w8 = std::pow(warped(frequency_hz) / warped(edge_hz(edge)), 8);
      magnitude *= (band <= edge ? 1 : w8) / (1 + w8);
    }
  return magnitude;
}

void OctaveBank::undo_phase(std::vector<double>& samples, bool loop) {
  if (samples.empty()) return;
  AllPass filter;
  if (loop) {
    // What a filter that has run forever would remember: the loop's end, as often as needed.
    const std::size_t size = samples.size();
    for (std::size_t i = 0; i < 2 * kBankTailFrames; ++i)
      filter.next(samples[(2 * kBankTailFrames - 1 - i) % size]);
  } else {
    samples.insert(samples.begin(), kBankTailFrames, 0.0);
  }
  for (std::size_t i = samples.size(); i-- > 0;) samples[i] = filter.next(samples[i]);
}

Bands OctaveBank::mean_squares(std::span<const float> samples) {
  OctaveBank bank;
  std::array<double, kBandCount> sum{};
  alignas(64) double lanes[kStepFrames * kBusLanes];
  for (std::size_t first = 0; first < samples.size(); first += kStepFrames) {
    const int frames = static_cast<int>(std::min<std::size_t>(kStepFrames, samples.size() - first));
    for (int i = 0; i < frames * kBusLanes; ++i) lanes[i] = samples[first + i / kBusLanes];
    filter_lanes(bank.cascade_, lanes, frames);
    for (int f = 0; f < frames; ++f)
      for (std::size_t band = 0; band < kBandCount; ++band) {
        const double y = lanes[f * kBusLanes + bus_lane(band, 0)];
        sum[band] += y * y;
      }
  }
  Bands result{};
  for (std::size_t band = 0; band < kBandCount; ++band)
    if (!samples.empty())
      result[band] = static_cast<float>(sum[band] / static_cast<double>(samples.size()));
  return result;
}

}  // namespace clamor
