#include "runtime/field/late_density.h"

#include <algorithm>
#include <bit>
#include <cmath>

#include "common/random.h"

namespace clamor {

namespace {

// Replaces each value by the mean of its neighbours, `around` to either side.
void smooth(std::vector<double>& values, std::size_t around) {
  std::vector<double> sums(values.size() + 1);
  for (std::size_t i = 0; i < values.size(); ++i) sums[i + 1] = sums[i] + values[i];
  for (std::size_t i = 0; i < values.size(); ++i) {
    const std::size_t first = i > around ? i - around : 0;
    const std::size_t end = std::min(i + around + 1, values.size());
    values[i] = (sums[end] - sums[first]) / static_cast<double>(end - first);
  }
}

}  // namespace

void LateDensity::begin() {
  ++passes_;
  const std::size_t count = bins_.size();
  rules_.assign(count, {});
  std::vector<double> column(count), squares(count);
  for (std::size_t b = 0; b < kBands; ++b) {
    for (std::size_t i = 0; i < count; ++i) column[i] = static_cast<double>(bins_[i].power[b]);
    for (int twice = 0; twice < 2; ++twice) smooth(column, kSmooth_bins / 2);
    for (std::size_t i = 0; i < count; ++i) {
      const double per_s = column[i] * kSampleRate_hz / kBin_frames;
      rules_[i].pieces_per_power[b] = per_s > 0 ? static_cast<float>(kPieces_per_s / per_s) : 0.0f;
    }
  }
  for (std::size_t i = 0; i < count; ++i) {
    column[i] = std::popcount(bins_[i].arrivals);
    squares[i] = column[i] * column[i];
  }
  smooth(column, kCount_bins);
  smooth(squares, kCount_bins);
  for (std::size_t i = 0; i < count; ++i)
    rules_[i].spreads = squares[i] - column[i] * column[i] < kMostClustered * column[i];
  bins_.assign(count, {});
}

double LateDensity::pieces(double delay_frames, const Bands& power) {
  const double at = std::max(delay_frames, 0.0) / kBin_frames;
  const auto bin = static_cast<std::size_t>(at);
  if (bin >= bins_.size()) bins_.resize(bin + 1);
  Bin& here = bins_[bin];
  for (std::size_t b = 0; b < kBands; ++b) here.power[b] += power[kFirstBand + b];
  if (bin >= rules_.size()) return 1;
  const Rule& rule = rules_[bin];
  float wanted = 0;
  for (std::size_t b = 0; b < kBands; ++b)
    wanted = std::max(wanted, rule.pieces_per_power[b] * power[kFirstBand + b]);
  if (wanted > kCounts)
    here.arrivals |= std::uint64_t{1} << static_cast<int>((at - static_cast<double>(bin)) * 64);
  if (!rule.spreads || !(wanted > 1)) return 1;
  const double share =
      std::clamp((delay_frames - kFrom_frames) / (kWhole_frames - kFrom_frames), 0.0, 1.0);
  constexpr double kMost = kPieces_per_s * kWidth_frames / kSampleRate_hz;
  return 1 + share * (std::min(static_cast<double>(wanted), kMost) - 1);
}

LateDensity::Piece LateDensity::piece(std::uint32_t tap, std::uint32_t k, double pieces) {
  if (pieces <= 1) return {0, 1};
  const auto amplitude = static_cast<float>(std::sqrt(std::min(pieces - k, 1.0) / pieces));
  if (k == 0) return {0, amplitude};
  const RandomBits bits = philox(0x1a7e, {tap, k, 0, 0});
  return {(unit(bits[0]) - 0.5) * kWidth_frames, bits[1] % 2 == 0 ? amplitude : -amplitude};
}

}  // namespace clamor
