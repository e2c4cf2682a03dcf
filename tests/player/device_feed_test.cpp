// device_feed_test.cpp: a device's input at its own rate, in blocks of any size, without clicks.
#include "runtime/output/device_feed.h"

#include <cmath>
#include <complex>
#include <numbers>
#include <random>

#include <gtest/gtest.h>

#include "common/sample_rate.h"
#include "tools/analysis/click_detector.h"

namespace clamor {
namespace {

constexpr double kAmplitude = 0.5;

// A mixer that plays a sine at each ear.
struct Sines {
  double left_hz, right_hz;
  std::uint64_t frame = 0;

  OutputCallback callback() {
    return {[](void* self, float* output, std::uint32_t frames, bool) noexcept {
              auto& sines = *static_cast<Sines*>(self);
              for (std::uint32_t i = 0; i < frames; ++i, ++sines.frame) {
                const double t = static_cast<double>(sines.frame) / kSampleRate_hz;
                output[2 * i] = static_cast<float>(
                    kAmplitude * std::sin(2 * std::numbers::pi * sines.left_hz * t));
                output[2 * i + 1] = static_cast<float>(
                    kAmplitude * std::sin(2 * std::numbers::pi * sines.right_hz * t));
              }
            },
            this};
  }
};

// Blocks of the given sizes, from a device that keeps time.
template <class Sizes>
std::vector<float> played(OutputCallback callback, int rate_hz, double seconds, Sizes sizes) {
  const auto gate = std::make_shared<CallbackGate>(callback);
  DeviceFeed feed(gate, 1, 2);
  EXPECT_TRUE(feed.prepare(rate_hz, 256).ok());
  gate->give_to(1);
  const auto start = DeviceFeed::Clock::now();
  std::vector<float> all;
  while (static_cast<double>(all.size()) < 2 * seconds * rate_hz) {
    std::vector<float> block(2 * sizes(), 9);
    const std::chrono::duration<double> time(static_cast<double>(all.size()) / 2 / rate_hz);
    feed.fill_at(start + std::chrono::duration_cast<DeviceFeed::Clock::duration>(time),
                 block.data(), static_cast<std::uint32_t>(block.size() / 2), false);
    all.insert(all.end(), block.begin(), block.end());
  }
  EXPECT_FALSE(feed.ran_away());
  return all;
}

auto blocks_of(std::size_t frames) {
  return [frames] { return frames; };
}

auto blocks_of_any_size() {
  return [random = std::minstd_rand(1)]() mutable {
    return random() % 3 == 0 ? 1 + random() % 16 : 1 + random() % 4096;
  };
}

struct Sine {
  double level_db;     // of the sine, relative to the mixer's
  double residual_db;  // of everything else, relative to the sine
};

// Fits a sine of that frequency to the second half by least squares; the rest is the residual.
Sine fitted(const std::vector<float>& samples, std::size_t channel, double frequency_hz,
            double rate_hz) {
  double ss = 0, cc = 0, sc = 0, xs = 0, xc = 0;
  const std::size_t first = samples.size() / 4 * 2;
  const auto angle = [&](std::size_t i) {
    return 2 * std::numbers::pi * frequency_hz * static_cast<double>(i / 2) / rate_hz;
  };
  for (std::size_t i = first + channel; i < samples.size(); i += 2) {
    const double s = std::sin(angle(i)), c = std::cos(angle(i)), x = samples[i];
    ss += s * s, cc += c * c, sc += s * c, xs += x * s, xc += x * c;
  }
  const double determinant = ss * cc - sc * sc;
  const double a = (xs * cc - xc * sc) / determinant, b = (xc * ss - xs * sc) / determinant;
  double rest = 0, whole = 0;
  for (std::size_t i = first + channel; i < samples.size(); i += 2) {
    const double wave = a * std::sin(angle(i)) + b * std::cos(angle(i));
    rest += std::pow(samples[i] - wave, 2), whole += wave * wave;
  }
  return {20 * std::log10(std::hypot(a, b) / kAmplitude), 10 * std::log10(rest / whole)};
}

std::vector<float> channel_of(const std::vector<float>& samples, std::size_t channel) {
  std::vector<float> one;
  for (std::size_t i = channel; i < samples.size(); i += 2) one.push_back(samples[i]);
  return one;
}

TEST(DeviceFeed, GivesTheMixersFramesInOrderWhateverTheBlocks) {
  Sines one{440, 997}, other{440, 997};
  const auto whole = played(one.callback(), kSampleRate_hz, 2, blocks_of(64));
  const auto torn = played(other.callback(), kSampleRate_hz, 2, blocks_of_any_size());
  for (std::size_t i = 0; i < std::min(whole.size(), torn.size()); ++i)
    ASSERT_EQ(whole[i], torn[i]) << i;
}

class AtAnotherRate : public ::testing::TestWithParam<int> {};

TEST_P(AtAnotherRate, SinesKeepTheirPitchAndLevelAndGainNothingElse) {
  const double rate_hz = GetParam();
  // Up to 90 % of half the lower rate, where the filter is flat.
  const double max_hz = 0.9 * std::min(rate_hz, 1.0 * kSampleRate_hz) / 2;
  for (const auto& [left_hz, right_hz] : {std::pair{63.0, 1000.0}, {0.4 * max_hz, 0.9 * max_hz}}) {
    Sines sines{left_hz, right_hz};
    const auto heard = played(sines.callback(), GetParam(), 1, blocks_of_any_size());
    for (const auto& [channel, frequency_hz] : {std::pair{0u, left_hz}, {1u, right_hz}}) {
      const Sine sine = fitted(heard, channel, frequency_hz, rate_hz);
      EXPECT_NEAR(sine.level_db, 0, 0.05) << frequency_hz;
      EXPECT_LT(sine.residual_db, -100) << frequency_hz;
      std::vector<float> steady = channel_of(heard, channel);
      steady.erase(steady.begin(), steady.begin() + 4096);  // the start of a sine is a click
      EXPECT_TRUE(find_clicks(steady, 1e-4 * kAmplitude).empty()) << frequency_hz;
    }
  }
}

TEST_P(AtAnotherRate, EqualsWhatOneBlockWouldHaveGiven) {
  Sines one{440, 997}, other{440, 997};
  const auto whole = played(one.callback(), GetParam(), 1, blocks_of(128));
  const auto torn = played(other.callback(), GetParam(), 1, blocks_of_any_size());
  for (std::size_t i = 0; i < std::min(whole.size(), torn.size()); ++i)
    ASSERT_NEAR(whole[i], torn[i], 1e-6) << i;
}

INSTANTIATE_TEST_SUITE_P(Rates, AtAnotherRate,
                         ::testing::Values(8000, 22050, 32000, 44100, 96000, 192000),
                         [](const auto& rate) { return std::to_string(rate.param); });

TEST(DeviceFeed, BringsNothingDownFromAboveHalfTheRate) {
  for (const int rate_hz : {8000, 22050, 32000, 44100}) {
    // The filter's transition begins at 90 % and ends as far above.
    Sines sines{std::min(0.5 * rate_hz * 1.11, 23900.0), 23950};
    const auto heard = played(sines.callback(), rate_hz, 1, blocks_of(256));
    for (std::size_t i = heard.size() / 2; i < heard.size(); ++i)
      ASSERT_LT(std::abs(heard[i]), 1e-5) << i;
  }
}

// A device may fill its buffers ahead of time and be late by a quarter of a second, but not more.
TEST(DeviceFeed, FollowsADeviceWhoseClockIsOnePerCentFastForAnHour) {
  const auto gate = std::make_shared<CallbackGate>(
      OutputCallback{[](void*, float*, std::uint32_t, bool) noexcept {}, nullptr});
  DeviceFeed feed(gate, 1, 2);
  ASSERT_TRUE(feed.prepare(kSampleRate_hz, 4096).ok());
  gate->give_to(1);
  std::vector<float> block(2 * 4096);
  const auto start = DeviceFeed::Clock::now();
  for (int i = 0; i < 3600 * kSampleRate_hz / 4096; ++i) {
    const std::chrono::duration<double> time(4096 * i / 1.01 / kSampleRate_hz);
    feed.fill_at(start + std::chrono::duration_cast<DeviceFeed::Clock::duration>(time),
                 block.data(), 4096, false);
  }
  EXPECT_FALSE(feed.ran_away());
}

TEST(DeviceFeed, OfAnotherGetsSilence) {
  Sines sines{440, 997};
  const auto gate = std::make_shared<CallbackGate>(sines.callback());
  DeviceFeed first(gate, 1, 2), second(gate, 2, 2);
  ASSERT_TRUE(first.prepare(kSampleRate_hz, 64).ok());
  ASSERT_TRUE(second.prepare(kSampleRate_hz, 64).ok());
  gate->give_to(2);
  std::vector<float> block(128, 9);
  first.callback().fill(&first, block.data(), 64, false);
  EXPECT_EQ(block, std::vector<float>(128, 0));
  EXPECT_EQ(sines.frame, 0u);
  second.callback().fill(&second, block.data(), 64, false);
  EXPECT_EQ(sines.frame, 64u);
  EXPECT_EQ(gate->counters().callbacks, 1u);
}

}  // namespace
}  // namespace clamor
