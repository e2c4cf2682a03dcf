#include "runtime/field/sparse_response.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <numbers>

#include "common/crossover.h"
#include "common/sample_rate.h"
#include "runtime/hrtf/hrtf_filters.h"
#include "runtime/realtime/prefetch.h"
#include "runtime/voices/octave_filter_bank.h"

namespace clamor {

namespace {

using Matrix = std::array<std::array<double, kBandCount>, kBandCount>;

// What an octave bus passes of its layer, which the split of the layers has already cut.
double bus_in_layer(const MixMode& mode, std::size_t bus, double frequency_hz) {
  const bool is_low = bus < kLowBands;
  const double split = crossover_magnitude(kLowBands - 1, kSampleRate_hz,
                                           is_low ? Side::kLow : Side::kHigh, frequency_hz);
  if (!mode.head) return OctaveFilterBank::magnitude(bus, frequency_hz) / split;
  double gain = 0;
  for (std::size_t j = is_low ? 0 : kHrtfLowBands; j < (is_low ? kHrtfLowBands : kHrtfBands); ++j)
    if (const float share = HrtfFilters::octave_share(bus, j); share != 0)
      gain += static_cast<double>(share) * HrtfFilters::magnitude(j, frequency_hz) / split;
  return gain;
}

// Filters of the lanes, [index][lane], for octave gains: the buses' filters times the matrix that
// makes buses of gains, over the spline's response and the scale of the transform.
std::vector<float> lane_filters(const MixMode& mode, const FieldLayer& layer, std::size_t lanes,
                                bool is_low) {
  // The split leaves nothing of a layer beyond these, where the buses' shares of it are not known.
  const double first_hz = is_low ? 0 : 100, last_hz = is_low ? 5000 : 23'500;
  const double rate_hz = 1.0 * kSampleRate_hz / (is_low ? kLowRate : 1);
  const auto points = static_cast<double>(layer.transform);
  constexpr std::size_t kLanes = 8;  // bands once, or twice
  const LaneFourier fourier(layer.transform, kLanes);
  const Matrix& gains = mode.head ? HrtfFilters::bus_gains() : OctaveFilterBank::bus_gains();
  std::vector<std::array<float, kBandCount>> by_bin(layer.transform / 2 + 1);
  for (std::size_t bin = 0; bin < by_bin.size(); ++bin) {
    const double frequency_hz = static_cast<double>(bin) * rate_hz / points;
    const double cosine = std::cos(2 * std::numbers::pi * static_cast<double>(bin) / points);
    // Windows of the high layer hold spline coefficients for cubic interpolation, halved as the
    // mixer reads them, and samples otherwise; those of the low layer hold samples.
    const bool has_coefficients = !is_low && mode.interpolation == Interpolation::kCubic;
    const double scale = is_low ? 4 / (3 + cosine) : has_coefficients ? 2 : 3 / (2 + cosine);
    for (std::size_t bus = is_low ? 0 : kLowBands; bus < (is_low ? kLowBands : kBandCount); ++bus) {
      const double passed =
          scale / points * bus_in_layer(mode, bus, std::clamp(frequency_hz, first_hz, last_hz));
      for (std::size_t lane = 0; lane < kBandCount; ++lane)
        by_bin[bin][lane] += static_cast<float>(passed * gains[bus][lane]);
    }
  }
  std::vector<float> filters(layer.transform * kLanes);
  for (std::size_t index = 0; index < layer.transform; ++index) {
    const std::size_t bin = fourier.bin(index);
    const auto& at = by_bin[std::min(bin, layer.transform - bin)];
    for (std::size_t lane = 0; lane < kLanes; ++lane)
      filters[index * kLanes + lane] = at[kBandCount - lanes + lane % lanes];
  }
  return filters;
}

using LayerFilters = std::array<std::vector<float>, 2>;  // of the high layer and of the low one

// Computed once for each kind of mode that has a field.
template <bool kHead, Interpolation kInterpolation>
const LayerFilters& filters_of() {
  static const LayerFilters kFilters = [] {
    const MixMode mode{.interpolation = kInterpolation, .head = kHead};
    return LayerFilters{lane_filters(mode, kHighField, kHighFieldLanes, false),
                        lane_filters(mode, kLowField, kLowFieldLanes, true)};
  }();
  return kFilters;
}

const LayerFilters& filters_of(const MixMode& mode) {
  if (mode.interpolation == Interpolation::kCubic)
    return mode.head ? filters_of<true, Interpolation::kCubic>()
                     : filters_of<false, Interpolation::kCubic>();
  return mode.head ? filters_of<true, Interpolation::kLinear>()
                   : filters_of<false, Interpolation::kLinear>();
}

}  // namespace

template <std::size_t kBands>
SparseResponse::Layer<kBands>::Layer(const FieldLayer& layer_size,
                                     const std::vector<float>& lane_filters)
    : size(layer_size), fourier(layer_size.transform, kLanes), filters(lane_filters) {
  for (std::vector<Vector>& ear : work) ear.resize(layer_size.transform * kLanes / 16);
}

SparseResponse::SparseResponse(const MixMode& mode)
    : high_(kHighField, filters_of(mode)[0]), low_(kLowField, filters_of(mode)[1]) {}

void SparseResponse::reserve(std::size_t partitions) {
  if (partitions <= touched_.size()) return;
  touched_.resize(partitions);
  for (std::vector<float>& rows : high_.rows)
    rows.resize((partitions * kHighField.partition + 2 * kPad) * kHighFieldLanes);
  for (std::vector<float>& rows : low_.rows)
    rows.resize((partitions * kLowField.partition + 2 * kPad) * kLowFieldLanes);
}

void SparseResponse::add(std::size_t ear, std::span<const Tap> taps) {
  float* const high = high_.rows[ear].data() + kPad * kHighFieldLanes;
  float* const low = low_.rows[ear].data() + kPad * kLowFieldLanes;
  const auto fetch = [&](std::span<const Tap> some) {
    for (const Tap& tap : some) {
      prefetch_to_write(high + (tap.high - 1) * std::ptrdiff_t{kHighFieldLanes},
                        4 * kHighFieldLanes * sizeof(float));
      prefetch_to_write(low + (tap.low - 1) * std::ptrdiff_t{kLowFieldLanes},
                        3 * kLowFieldLanes * sizeof(float));
    }
  };
  for (const Tap& tap : taps) {
    constexpr int kReach = kLowRate * static_cast<int>(kPad);
    assert(tap.high >= 0 && tap.low >= 0);
    const auto first = static_cast<std::size_t>(std::max(tap.high - kReach, 0)),
               last = static_cast<std::size_t>(tap.high + kReach);
    touched_[first / kHighField.partition] = 1;
    touched_[std::min(last / kHighField.partition, touched_.size() - 1)] = 1;
  }
  constexpr std::size_t kAtOnce = 16;  // whose rows are in the cache
  fetch(taps.first(std::min(kAtOnce, taps.size())));
  for (std::size_t at = 0; at < taps.size(); at += kAtOnce) {
    const std::size_t end = std::min(at + kAtOnce, taps.size());
    fetch(taps.subspan(end, std::min(kAtOnce, taps.size() - end)));
    add_taps(taps.subspan(at, end - at), high, low);
  }
}

template <std::size_t kBands>
void SparseResponse::Layer<kBands>::transform(std::span<const std::size_t> partitions,
                                              const std::array<float*, kPartitions>& spectra) {
  for (std::size_t e = 0; e < kEars; ++e) {
    float* const lanes = work[e].data()->floats.data();
    std::fill_n(lanes, size.transform / 2 * kLanes, 0.0f);
    for (std::size_t i = 0; i < partitions.size(); ++i) {
      // The pads belong to the first and to the last partition, whose margins have room for them.
      const std::size_t first = partitions[i] * size.partition, end = first + size.partition;
      const std::size_t before = first == 0 ? kPad : 0;
      const std::size_t after = (end + 2 * kPad) * kBands == rows[e].size() ? kPad : 0;
      const std::size_t frames = before + size.partition + after;
      float* const from = rows[e].data() + (kPad + first - before) * kBands;
      float* const to = lanes + (size.margin - before) * kLanes + i * kBands;
      for (std::size_t f = 0; f < frames; ++f)
        std::copy_n(from + f * kBands, kBands, to + f * kLanes);
      std::fill_n(from, frames * kBands, 0.0f);
    }
  }
  fourier.forward_of_half(work[0].data()->floats.data(), work[1].data()->floats.data());
  for (std::size_t e = 0; e < kEars; ++e) {  // real and imaginary parts
    const auto part_of = [&](std::size_t i) {
      return i < partitions.size() ? spectra[i] + e * size.transform : nullptr;
    };
    join_bands(work[e].data()->floats.data(), filters.data(), size.transform, part_of(0),
               kPartitions > 1 ? part_of(1) : nullptr);
  }
}

void SparseResponse::transform(const std::array<std::size_t, 2>& partitions,
                               const std::array<FieldSpectrum*, 2>& spectra, std::size_t count) {
  const std::span some = std::span(partitions).first(count);
  std::array<float*, 2> high{};
  for (std::size_t i = 0; i < count; ++i) {
    high[i] = sums_[i].high.data();
    low_.transform(some.subspan(i, 1), {sums_[i].low.data()});
    touched_[some[i]] = 0;
  }
  if (count > 0) high_.transform(some, high);
  for (std::size_t i = 0; i < count; ++i) pack(sums_[i], *spectra[i]);
}

}  // namespace clamor
