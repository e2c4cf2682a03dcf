#include "tools/analysis/spectrogram.h"

#include <algorithm>
#include <cmath>
#include <complex>
#include <cstdint>
#include <numbers>

#include <fmt/format.h>

#include "common/fourier.h"
#include "common/sample_rate.h"
#include "tools/analysis/chart.h"

namespace clamor {

namespace {

constexpr std::size_t kFrame = 16384, kSpectrogramHop = kFrame / 4;
constexpr int kFirstThird = -15;  // index of the lowest band relative to 1 kHz
constexpr double kRange_db = 60;
constexpr int kShades = 20;  // 3 dB each

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

// Perceptually uniform colours from dark to light (S. van der Walt, N. Smith. Viridis, 2015).
std::string colour(int shade) {
  constexpr std::array<std::array<double, 3>, 5> kStops = {
      {{68, 1, 84}, {59, 82, 139}, {33, 145, 140}, {94, 201, 98}, {253, 231, 37}}};
  const double at = 4.0 * shade / (kShades - 1);
  const auto stop = std::min<std::size_t>(static_cast<std::size_t>(at), 3);
  std::array<int, 3> mixed{};
  for (std::size_t c = 0; c < 3; ++c)
    mixed[c] = static_cast<int>(std::lround(
        std::lerp(kStops[stop][c], kStops[stop + 1][c], at - static_cast<double>(stop))));
  return fmt::format("#{:02x}{:02x}{:02x}", mixed[0], mixed[1], mixed[2]);
}

double db(double power) { return 10 * std::log10(std::max(power, 1e-20)); }

constexpr double kWidth = 760, kHeight = 330, kLeft = 74, kTop = 40, kRight = 90, kBottom = 56;
constexpr double kWide = kWidth - kLeft - kRight, kHigh = kHeight - kTop - kBottom;

// One SVG path per shade, made of runs along a band, in units of columns and bands.
std::array<std::string, kShades> paths_of(const Spectrogram& spectrogram, double loudest_db) {
  const auto shade_of = [&](double power) {
    const double up = (db(power) - loudest_db) / kRange_db + 1;
    return std::clamp(static_cast<int>(up * kShades), 0, kShades - 1);
  };
  std::array<std::string, kShades> paths;
  for (int b = 0; b < kThirdOctaves; ++b)
    for (std::size_t c = 0; c < spectrogram.power.size();) {
      const int shade = shade_of(spectrogram.power[c][static_cast<std::size_t>(b)]);
      std::size_t end = c + 1;
      while (end < spectrogram.power.size() &&
             shade_of(spectrogram.power[end][static_cast<std::size_t>(b)]) == shade)
        ++end;
      if (shade > 0)
        paths[static_cast<std::size_t>(shade)] +=
            fmt::format("M{} {}h{}v1H{}z", c, kThirdOctaves - 1 - b, end - c, c);
      c = end;
    }
  return paths;
}

std::string draw_labels(const Spectrogram& spectrogram, double columns) {
  const std::string at_end = "text-anchor=\"end\"", in_middle = "text-anchor=\"middle\"";
  std::string svg;
  constexpr std::array<int, 9> kOctaves_hz = {63, 125, 250, 500, 1000, 2000, 4000, 8000, 16000};
  for (std::size_t octave = 0; octave < kOctaves_hz.size(); ++octave) {
    const double band = 3 * static_cast<double>(octave + 1);
    svg += svg_text(kLeft - 8, kTop + kHigh * (kThirdOctaves - 0.5 - band) / kThirdOctaves + 4,
                    short_number(kOctaves_hz[octave]), at_end);
  }
  const double shown_s = spectrogram.column_s * columns;
  const double decade_s =
      std::pow(10, std::floor(std::log10(std::max(spectrogram.length_s, 1e-3) / 4)));
  double tick_s = decade_s;  // the longest of 1, 2 and 5 decades that gives at least four ticks
  for (const double digit : {2.0, 5.0})
    if (4 * digit * decade_s <= spectrogram.length_s) tick_s = digit * decade_s;
  for (double at_s = 0; at_s <= spectrogram.length_s * 1.0001; at_s += tick_s)
    svg += svg_text(kLeft + kWide * at_s / std::max(shown_s, 1e-9), kTop + kHigh + 18,
                    short_number(at_s), in_middle);
  svg += svg_text(kLeft + kWide / 2, kHeight - 14, "time (s)", in_middle);
  svg += svg_text(16, kTop - 8, "Hz");
  return svg;
}

std::string draw_legend(double loudest_db) {
  std::string svg;
  const double scale_x = kWidth - kRight + 12, shade_high = kHigh / kShades;
  for (int shade = 0; shade < kShades; ++shade)
    svg += fmt::format("<rect x=\"{}\" y=\"{:.2f}\" width=\"14\" height=\"{:.2f}\" fill=\"{}\"/>",
                       scale_x, kTop + kHigh - shade_high * (shade + 1), shade_high + 0.5,
                       colour(shade));
  for (int shade = 0; shade <= kShades; shade += 5)
    svg += svg_text(scale_x + 20, kTop + kHigh - shade_high * shade + 4,
                    fmt::format("{:.0f} dB", loudest_db + kRange_db * (1.0 * shade / kShades - 1)));
  return svg;
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

  std::vector<double> window(kFrame);
  for (std::size_t i = 0; i < kFrame; ++i)
    window[i] =
        0.5 - 0.5 * std::cos(2 * std::numbers::pi * (static_cast<double>(i) + 0.5) / kFrame);
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

std::string to_svg(const Spectrogram& spectrogram, const std::string& title) {
  const auto columns = static_cast<double>(std::max<std::size_t>(spectrogram.power.size(), 1));
  double loudest_db = -200;
  for (const auto& column : spectrogram.power)
    for (const double power : column) loudest_db = std::max(loudest_db, db(power));
  loudest_db = std::ceil(loudest_db / 3) * 3;
  const auto paths = paths_of(spectrogram, loudest_db);
  std::string svg = fmt::format(
      "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {0} {1}\" width=\"100%\" "
      "font-family=\"sans-serif\" font-size=\"13\">"
      "<rect width=\"{0}\" height=\"{1}\" fill=\"white\"/>",
      kWidth, kHeight);
  svg += svg_text(kLeft, 24, title, "font-size=\"14\" font-weight=\"bold\" fill=\"#111\"");
  svg += fmt::format(
      "<g shape-rendering=\"crispEdges\" transform=\"translate({} {}) scale({:.6f} {:.6f})\">",
      kLeft, kTop, kWide / columns, kHigh / kThirdOctaves);
  svg += fmt::format("<path fill=\"{}\" d=\"M0 0h{}v{}H0z\"/>", colour(0), columns, kThirdOctaves);
  for (int shade = 1; shade < kShades; ++shade)
    if (const std::string& path = paths[static_cast<std::size_t>(shade)]; !path.empty())
      svg += fmt::format("<path fill=\"{}\" d=\"{}\"/>", colour(shade), path);
  svg += "</g>";
  svg += draw_labels(spectrogram, columns);
  svg += draw_legend(loudest_db);
  return svg + "</svg>";
}

}  // namespace clamor
