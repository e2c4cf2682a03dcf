#include "tools/analysis/click_detector.h"

#include <algorithm>
#include <cmath>

#include <gtest/gtest.h>

#include "tests/tools/analysis/test_sounds.h"

namespace clamor {
namespace {

using testing::noise;
using testing::plus;
using testing::sine;

std::vector<Click> clicks_in(const std::vector<float>& samples) {
  float peak = 0;
  for (const float x : samples) peak = std::max(peak, std::abs(x));
  return find_clicks(samples, 1e-4 * peak);
}

// A chord that swells and fades, over faint noise.
std::vector<float> chord(double seconds) {
  std::vector<float> sum = noise(9, 1e-4, seconds);
  for (const double hz : {110.0, 277.2, 659.3, 1760.0, 4400.0})
    sum = plus(std::move(sum), sine(hz, 0.1, seconds));
  return testing::swelling(std::move(sum));
}

TEST(Levinson, FindsThePredictorOfAKnownProcess) {
  // x[n] = a x[n-1] + white noise has the autocorrelation a^k.
  std::vector<double> r(33);
  for (std::size_t k = 0; k < r.size(); ++k) r[k] = std::pow(0.9, k);
  const auto one = levinson(r);
  EXPECT_NEAR(one[0], 0.9, 1e-12);
  for (std::size_t k = 1; k < one.size(); ++k) EXPECT_NEAR(one[k], 0, 1e-12);
  // x[n] = 1.2 x[n-1] - 0.5 x[n-2] + noise: r1 = 1.2 / 1.5 r0, then the recursion.
  r[0] = 1;
  r[1] = 0.8;
  for (std::size_t k = 2; k < r.size(); ++k) r[k] = 1.2 * r[k - 1] - 0.5 * r[k - 2];
  const auto two = levinson(r);
  EXPECT_NEAR(two[0], 1.2, 1e-12);
  EXPECT_NEAR(two[1], -0.5, 1e-12);
  for (std::size_t k = 2; k < two.size(); ++k) EXPECT_NEAR(two[k], 0, 1e-12);
  EXPECT_EQ(levinson(std::vector<double>(5)), std::vector<double>(4));
}

TEST(ClickDetector, FindsNoneInNoiseOrMusic) {
  EXPECT_TRUE(clicks_in(noise(1, 0.1, 20)).empty());
  EXPECT_TRUE(clicks_in(chord(5)).empty());
  EXPECT_TRUE(clicks_in(std::vector<float>(48000)).empty());
  EXPECT_TRUE(clicks_in({}).empty());
}

TEST(ClickDetector, FindsClicksWithTheirPositionAndSize) {
  constexpr double kSigma = 0.01;
  for (const std::size_t at : {100u, 1023u, 1024u, 70000u, 143000u}) {
    for (const double size : {20.0, 60.0}) {
      auto sound = noise(2, kSigma, 3);
      sound[at] += static_cast<float>(size * kSigma);
      const auto clicks = clicks_in(sound);
      ASSERT_EQ(clicks.size(), 1u) << at;
      EXPECT_EQ(clicks[0].frame, at);
      // The size depends on the noise, on the greatest of three medians, and on the fit, which the
      // click distorts.
      EXPECT_NEAR(clicks[0].sigmas / size, 1, 0.25) << at;
    }
    auto sound = noise(2, kSigma, 3);
    sound[at] += static_cast<float>(6 * kSigma);
    EXPECT_TRUE(clicks_in(sound).empty()) << "6 sigma are chance";
  }
}

TEST(ClickDetector, FindsASplicedWaveButNotASlidingDelay) {
  // One delay jumps by a dozen samples; the other changes as much within 50 ms.
  auto torn = chord(4), slid = chord(4);
  const auto whole = chord(4);
  constexpr std::size_t kAt = 96000, kJump = 12, kSlide = 2400;
  for (std::size_t i = kAt; i < whole.size(); ++i) {
    torn[i] = whole[i - kJump];
    const double share = std::min(1.0, static_cast<double>(i - kAt) / kSlide);
    const double from = static_cast<double>(i) - kJump * share;
    const auto j = static_cast<std::size_t>(from);
    const double t = from - static_cast<double>(j);
    // The interpolation is cubic, so that its error is below the noise.
    const double y0 = whole[j - 1], y1 = whole[j], y2 = whole[j + 1],
                 y3 = whole[j + 2 < whole.size() ? j + 2 : j + 1];
    slid[i] = static_cast<float>(
        y1 +
        0.5 * t * (y2 - y0 + t * (2 * y0 - 5 * y1 + 4 * y2 - y3 + t * (3 * (y1 - y2) + y3 - y0))));
  }
  const auto clicks = clicks_in(torn);
  ASSERT_EQ(clicks.size(), 1u);
  EXPECT_NEAR(static_cast<double>(clicks[0].frame), kAt, 33);
  EXPECT_TRUE(clicks_in(slid).empty());
}

TEST(ClickDetector, FindsClicksInPureTones) {
  auto tone = sine(440, 0.5, 2);
  EXPECT_TRUE(clicks_in(tone).empty());
  tone[50000] += 0.01f;
  ASSERT_EQ(clicks_in(tone).size(), 1u);
  EXPECT_EQ(clicks_in(tone)[0].frame, 50000u);
}

TEST(ClickDetector, FindsNoneAtTheEndsOfARecordingButOneAtAnAbruptOnset) {
  const auto tone = sine(300, 0.5, 1);
  const std::vector<float> cut(tone.begin() + 11000, tone.end() - 333);
  EXPECT_TRUE(clicks_in(cut).empty());
  auto set_in = tone;
  std::fill(set_in.begin(), set_in.begin() + 20040, 0.0f);  // at a quarter of a period
  ASSERT_EQ(clicks_in(set_in).size(), 1u);
  EXPECT_EQ(clicks_in(set_in)[0].frame, 20040u);
}

TEST(ClickDetector, MergesAdjacentClicksAndSeparatesDistantOnes) {
  auto sound = noise(3, 0.01, 2);
  for (const std::size_t at : {20000u, 20100u, 20200u, 21000u, 60000u}) sound[at] = 1;
  EXPECT_EQ(clicks_in(sound).size(), 3u);
}

TEST(NewClicks, AreThoseThatTheOtherSoundLacks) {
  const std::vector<Click> known = {{1000, 20}, {50000, 20}};
  const std::vector<Click> clicks = {{1200, 30}, {30000, 15}, {49800, 13}, {50400, 13}};
  const auto found = new_clicks(clicks, known);
  ASSERT_EQ(found.size(), 2u);
  EXPECT_EQ(found[0].frame, 30000u);
  EXPECT_EQ(found[1].frame, 50400u);
  EXPECT_TRUE(new_clicks({}, known).empty());
  EXPECT_EQ(new_clicks(clicks, {}).size(), clicks.size());
}

}  // namespace
}  // namespace clamor
