// A crowd made of loops must not repeat audibly.

#include <algorithm>
#include <cmath>
#include <complex>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "common/bands.h"
#include "common/fourier.h"
#include "common/sample_rate.h"
#include "formats/gltf/level_import.h"
#include "tests/build_paths.h"
#include "tests/sanitized.h"

namespace clamor {
namespace {

constexpr std::size_t kCrowdFrames = std::size_t{1} << 21;  // 44 s
constexpr std::size_t kCrowdWindow_frames = 960;            // 20 ms
constexpr double kSpeedOfSound_mps = 343, kCrowdRate_hz = kSampleRate_hz;

// Spectrum of the direct sound of all fans at one place, first 44 s. Fans with the same loop are
// summed within its period first.
std::vector<std::complex<double>> spectrum_of_crowd(const std::string& name, const Vec3& place,
                                                    const Fourier& fourier) {
  const auto imported =
      import_level(std::string(testing::kSourceDir) + "/assets/levels/" + name, ImportOptions{});
  EXPECT_TRUE(imported.ok());
  if (!imported.ok()) return {};
  const Level& level = imported->level;
  std::vector<std::vector<float>> periods;
  for (const Signal& signal : level.signals) periods.emplace_back(signal.samples.size(), 0.0f);
  for (const Emitter& fan : level.emitters) {
    const std::vector<float>& loop = level.signals[fan.signal].samples;
    std::vector<float>& period = periods[fan.signal];
    const double distance_m = std::max(1.0, length(fan.position_m - place));
    const double delay_s = fan.delay_s + distance_m / kSpeedOfSound_mps;
    const auto begin = static_cast<std::size_t>(std::lround(delay_s * kCrowdRate_hz)) % loop.size();
    const auto gain = static_cast<float>(fan.gain / distance_m);
    const std::size_t head = loop.size() - begin;
    for (std::size_t i = 0; i < head; ++i) period[begin + i] += gain * loop[i];
    for (std::size_t i = 0; i < begin; ++i) period[i] += gain * loop[head + i];
  }
  std::vector<std::complex<double>> mix(kCrowdFrames);
  for (const std::vector<float>& period : periods)
    for (std::size_t i = 0; i < kCrowdFrames; ++i)
      mix[i] += static_cast<double>(period[i % period.size()]);
  fourier.forward(mix);
  return mix;
}

// Maximum autocorrelation of an octave's envelope (mean squares of 20 ms) at lags of 0.5 to 10 s.
double repetition(const std::vector<std::complex<double>>& spectrum, double centre_hz,
                  const Fourier& fourier) {
  std::vector<std::complex<double>> octave(kCrowdFrames);
  const auto bin = [](double hz) {
    return static_cast<std::size_t>(hz * kCrowdFrames / kCrowdRate_hz);
  };
  for (std::size_t k = bin(centre_hz / std::sqrt(2)); k < bin(centre_hz * std::sqrt(2)); ++k)
    // Analytic signal: without negative frequencies, the magnitude is the envelope.
    octave[k] = spectrum[k];
  fourier.inverse(octave);
  std::vector<double> envelope(kCrowdFrames / kCrowdWindow_frames);
  double mean = 0;
  for (std::size_t w = 0; w < envelope.size(); ++w) {
    for (std::size_t i = 0; i < kCrowdWindow_frames; ++i)
      envelope[w] += std::norm(octave[w * kCrowdWindow_frames + i]);
    mean += envelope[w] / static_cast<double>(envelope.size());
  }
  const auto covariance = [&](std::size_t lag) {
    double sum = 0;
    for (std::size_t w = 0; w + lag < envelope.size(); ++w)
      sum += (envelope[w] - mean) * (envelope[w + lag] - mean);
    return sum / static_cast<double>(envelope.size() - lag);
  };
  const double windows_per_s = kCrowdRate_hz / kCrowdWindow_frames;
  double highest = -1;
  for (auto lag = static_cast<std::size_t>(0.5 * windows_per_s); lag <= 10 * windows_per_s; ++lag)
    highest = std::max(highest, covariance(lag) / covariance(0));
  return highest;
}

TEST(Crowd, OfTheStadiumHasNoAudiblePeriodOnThePitch) {
  if (testing::kSanitized) GTEST_SKIP() << "takes long under sanitizers, and shows nothing new";
  const Fourier fourier(kCrowdFrames);
  const auto spectrum = spectrum_of_crowd("stadium.glb", Vec3(30, 1.7, 20), fourier);
  ASSERT_FALSE(spectrum.empty());
  for (std::size_t b = 0; b < kBandCount; ++b)
    EXPECT_LT(repetition(spectrum, kBandCentres_hz[b], fourier), 0.3)
        << kBandCentres_hz[b] << " Hz";
  // Control: the paper's crowd of thirteen loops within 300 ms repeats after 4 s, which the measure
  // detects.
  const auto paper = spectrum_of_crowd("stadium_paper.glb", Vec3(0, 1.7, 0), fourier);
  ASSERT_FALSE(paper.empty());
  EXPECT_GT(repetition(paper, 1000, fourier), 0.9);
}

}  // namespace
}  // namespace clamor
