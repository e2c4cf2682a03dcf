#include "tools/analysis/random_texture.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <deque>
#include <numbers>

#include "common/fourier.h"
#include "common/random.h"
#include "common/sample_rate.h"
#include "runtime/hrtf/erb_bands.h"

namespace clamor {

namespace {

constexpr std::size_t kFrame = 2048, kHop = kFrame / 2, kBins = kFrame / 2 + 1;

// Squared windows half a frame apart add up to 1; over one frame their mean is one half, by which
// they reduce its power.
constexpr double kWindowPower = 0.5;
std::vector<double> sine_window() {
  std::vector<double> window(kFrame);
  for (std::size_t i = 0; i < kFrame; ++i)
    window[i] = std::sin(std::numbers::pi * (static_cast<double>(i) + 0.5) / kFrame);
  return window;
}

struct Power {
  double left = 0, right = 0;
  std::complex<double> cross = 0;  // conj(left) right

  void add(const Power& other, double sign = 1) {
    left += sign * other.left;
    right += sign * other.right;
    cross += sign * other.cross;
  }
};

// The mean over half an ERB to either side of each bin, at least two bins.
std::vector<Power> smoothed(const std::vector<Power>& powers) {
  std::vector<Power> sums(kBins + 1), means(kBins);
  for (std::size_t k = 0; k < kBins; ++k) {
    sums[k + 1] = sums[k];
    sums[k + 1].add(powers[k]);
  }
  for (std::size_t k = 0; k < kBins; ++k) {
    const double hz = static_cast<double>(k) * kSampleRate_hz / kFrame;
    const auto reach =
        static_cast<std::size_t>(std::max(2.0, erb_width_hz(hz) / 2 * kFrame / kSampleRate_hz));
    const std::size_t begin = k < reach ? 0 : k - reach, end = std::min(kBins, k + reach + 1);
    means[k].add(sums[end]);
    means[k].add(sums[begin], -1);
    const double scale = 1 / static_cast<double>(end - begin);
    means[k] = {std::max(0.0, means[k].left * scale), std::max(0.0, means[k].right * scale),
                means[k].cross * scale};
  }
  return means;
}

// Two independent Gaussians with mean square 1/2 each, as one complex number (Box and Muller 1958).
std::complex<double> gaussian(std::uint32_t a, std::uint32_t b) {
  return std::polar(std::sqrt(-std::log(unit_above_zero(a))), 2 * std::numbers::pi * unit(b));
}

}  // namespace

RandomTexture::RandomTexture(const Sound& sound)
    : frames_(sound.frames()), channels_(sound.channels.size()) {
  const Fourier fourier(kFrame);
  const std::vector<double> window = sine_window();
  std::vector<std::complex<double>> values(kFrame);
  const auto power_of_frame = [&](std::size_t f) {
    for (std::size_t i = 0; i < kFrame; ++i) {
      const std::size_t at = f * kHop + i - kHop;  // the first frame begins before the sound
      values[i] = 0;
      if (at < frames_)
        values[i] = {window[i] * sound.channels[0][at],
                     channels_ == 2 ? window[i] * sound.channels[1][at] : 0};
    }
    fourier.forward(values);
    std::vector<Power> bins(kBins);
    for (std::size_t k = 0; k < kBins; ++k) {
      const std::complex<double> mirror = std::conj(values[(kFrame - k) % kFrame]);
      const std::complex<double> left = (values[k] + mirror) / 2.0;
      const std::complex<double> right = (values[k] - mirror) * std::complex<double>(0, -0.5);
      bins[k] = {std::norm(left), std::norm(right), std::conj(left) * right};
    }
    return smoothed(bins);
  };

  const std::size_t count = (frames_ + kHop - 1) / kHop + 1;
  shapes_.resize(count * kBins);
  std::deque<std::vector<Power>> near = {
      power_of_frame(0)};  // the previous, current and next frame
  for (std::size_t f = 0; f < count; ++f) {
    if (f + 1 < count) near.push_back(power_of_frame(f + 1));
    for (std::size_t k = 0; k < kBins; ++k) {
      Power mean;
      for (const auto& powers : near) mean.add(powers[k]);
      const double scale = 1 / (kWindowPower * static_cast<double>(near.size()));
      const double left = mean.left * scale, right = mean.right * scale;
      const std::complex<double> cross = mean.cross * scale;
      const double shared = left > 0 ? std::norm(cross) / left : 0;
      shapes_[f * kBins + k] = {
          static_cast<float>(std::sqrt(left)),
          left > 0 ? std::complex<float>(cross / std::sqrt(left)) : std::complex<float>(0),
          static_cast<float>(std::sqrt(std::max(0.0, right - shared)))};
    }
    if (f > 0) near.pop_front();
  }
}

Sound RandomTexture::roll(std::uint64_t seed, std::uint32_t roll) const {
  const Fourier fourier(kFrame);
  const std::vector<double> window = sine_window();
  std::array<std::vector<double>, 2> sums;
  for (auto& sum : sums) sum.assign(frames_, 0);
  std::vector<std::complex<double>> values(kFrame);
  for (std::size_t f = 0; f * kBins < shapes_.size(); ++f) {
    for (std::size_t k = 0; k < kBins; ++k) {
      const Shape& shape = shapes_[f * kBins + k];
      const RandomBits bits =
          philox(seed, {roll, static_cast<std::uint32_t>(f), static_cast<std::uint32_t>(k),
                        static_cast<std::uint32_t>(Use::kPhase)});
      std::complex<double> x = gaussian(bits[0], bits[1]), y = gaussian(bits[2], bits[3]);
      if (k == 0 || k == kFrame / 2) {  // real bins
        x = x.real() * std::numbers::sqrt2;
        y = y.real() * std::numbers::sqrt2;
      }
      const std::complex<double> left = static_cast<double>(shape.first) * x;
      const std::complex<double> right =
          std::complex<double>(shape.along) * x + static_cast<double>(shape.second) * y;
      const std::complex<double> i(0, 1);
      values[k] = left + i * right;
      if (k > 0 && k < kFrame / 2) values[kFrame - k] = std::conj(left) + i * std::conj(right);
    }
    fourier.inverse(values);
    for (std::size_t i = 0; i < kFrame; ++i) {
      const std::size_t at = f * kHop + i - kHop;
      if (at >= frames_) continue;
      sums[0][at] += window[i] * values[i].real();
      sums[1][at] += window[i] * values[i].imag();
    }
  }
  Sound sound{{}, kSampleRate_hz, {}};
  for (std::size_t c = 0; c < channels_; ++c)
    sound.channels.emplace_back(sums[c].begin(), sums[c].end());
  return sound;
}

}  // namespace clamor
