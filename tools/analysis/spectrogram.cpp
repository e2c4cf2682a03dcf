#include "tools/analysis/spectrogram.h"

#include <algorithm>
#include <cmath>
#include <complex>

#include "common/fourier.h"
#include "common/sample_rate.h"
#include "tools/analysis/hann_window.h"

namespace clamor {

namespace {

constexpr std::size_t kFrame = 16384, kSpectrogramHop = kFrame / 4;
constexpr int kFirstThird = -15;  // index of the lowest band relative to 1 kHz

// Bins of a band with their weights; the first and the last count in part.
struct Share {
  std::size_t bin;
  double share;
};

std::vector<Share> bins_of(int band) {
  constexpr double kBin_hz = 1.0 * kSampleRate_hz / kFrame;
  const double low = third_octave_hz(band) * std::pow(10, -0.05) / kBin_hz;
  const double high = third_octave_hz(band) * std::pow(10, 0.05) / kBin_hz;
  std::vector<Share> shares;
  for (auto bin = static_cast<std::size_t>(low + 0.5);
       bin < kFrame / 2 && static_cast<double>(bin) < high + 0.5; ++bin) {
    const auto at = static_cast<double>(bin);
    shares.push_back({bin, std::min(high, at + 0.5) - std::max(low, at - 0.5)});
  }
  return shares;
}

}  // namespace

double third_octave_hz(int band) { return 1000 * std::pow(10, 0.1 * (band + kFirstThird)); }

Spectrogram spectrogram_of(const Sound& sound, std::size_t max_columns) {
  Spectrogram result;
  const std::size_t frames = sound.frames(), channels = sound.channels.size();
  if (frames == 0) return result;
  const std::size_t hops = (frames + kSpectrogramHop - 1) / kSpectrogramHop;
  const std::size_t hops_of_column = (hops + max_columns - 1) / max_columns;
  const std::size_t column_frames = hops_of_column * kSpectrogramHop;
  result.column_s = static_cast<double>(column_frames) / kSampleRate_hz;
  result.length_s = static_cast<double>(frames) / kSampleRate_hz;
  result.power.resize((hops + hops_of_column - 1) / hops_of_column);

  const std::vector<double> window = hann_window(kFrame, kFrame, 0.5);
  constexpr double kSquares = 3.0 / 8 * kFrame;  // energy of the window
  std::array<std::vector<Share>, kThirdOctaves> bands;
  for (int b = 0; b < kThirdOctaves; ++b) bands[static_cast<std::size_t>(b)] = bins_of(b);

  const Fourier fourier(kFrame);
  std::vector<std::complex<double>> values(kFrame);
  for (std::size_t hop = 0; hop < hops; ++hop) {
    // The frame centred on the hop; it may extend beyond the ends of the sound.
    const std::size_t first =
        hop * kSpectrogramHop + kSpectrogramHop / 2 - kFrame / 2;  // wraps round before the sound
    const std::size_t column = hop / hops_of_column;
    const std::size_t hops_here = std::min(hops - column * hops_of_column, hops_of_column);
    for (std::size_t c = 0; c < channels; c += 2) {
      for (std::size_t i = 0; i < kFrame; ++i) {
        const std::size_t at = first + i;
        values[i] = 0;
        if (at < frames)
          values[i] = {
              window[i] * static_cast<double>(sound.channels[c][at]),
              c + 1 < channels ? window[i] * static_cast<double>(sound.channels[c + 1][at]) : 0};
      }
      // One complex transform serves two channels: a bin and its mirror bin hold the power of both.
      fourier.forward(values);
      const double scale = 1 / (static_cast<double>(kFrame * channels * hops_here) * kSquares);
      for (std::size_t b = 0; b < kThirdOctaves; ++b)
        for (const auto& [bin, share] : bands[b])
          result.power[column][b] +=
              scale * share * (std::norm(values[bin]) + std::norm(values[kFrame - bin]));
    }
  }
  return result;
}

}  // namespace clamor
