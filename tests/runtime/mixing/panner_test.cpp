#include "runtime/mixing/panner.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include <gtest/gtest.h>

#include "tests/runtime/random_directions.h"

namespace clamor {
namespace {

using testing::random_directions;

Vec3f around(double azimuth_deg, double elevation_deg = 0) {
  return direction_of({Speaker::kFrontLeft, azimuth_deg, elevation_deg});
}

struct Sums {
  double power = 0;
  Vec3 velocity{}, energy{};
};
Sums sums_of(const LoudspeakerLayout& layout, const ChannelGains& gains) {
  Sums sums;
  for (std::size_t c = 0; c < layout.speakers.size(); ++c) {
    const double gain = gains[c];
    const Vec3 to(direction_of(layout.speakers[c]));
    sums.power += gain * gain;
    sums.velocity += gain * to;
    sums.energy += gain * gain * to;
  }
  return sums;
}

class LayoutPanning : public ::testing::TestWithParam<const char*> {
 protected:
  const LoudspeakerLayout layout_ = *find_layout(GetParam());
  const std::unique_ptr<Panner> panner_ = make_loudspeaker_panner(layout_);
};
INSTANTIATE_TEST_SUITE_P(Panner, LayoutPanning, ::testing::Values("5.1", "7.1", "7.1.4"));

TEST_P(LayoutPanning, KeepsThePowerOfAVoiceFromEveryDirection) {
  for (const Vec3f& from : random_directions(5000)) {
    const ChannelGains gains = panner_->gains(from);
    EXPECT_NEAR(sums_of(layout_, gains).power, 1, 1e-5);
    for (const float gain : gains) EXPECT_GE(gain, 0);
    EXPECT_EQ(gains[3], 0) << "LFE";
  }
}

TEST_P(LayoutPanning, UsesOneLoudspeakerAloneInItsDirection) {
  for (std::size_t c = 0; c < layout_.speakers.size(); ++c) {
    if (layout_.speakers[c].speaker == Speaker::kLowFrequency) continue;
    const ChannelGains gains = panner_->gains(direction_of(layout_.speakers[c]));
    for (std::size_t other = 0; other < kMaxChannels; ++other)
      EXPECT_NEAR(gains[other], other == c ? 1 : 0, 1e-3) << c << ' ' << other;
  }
}

// By the panning law, the sum of the directions weighted by amplitude points at the source: between
// any loudspeakers of a ring, and anywhere above it if there are loudspeakers above.
TEST_P(LayoutPanning, PointsAtTheSource) {
  for (const double elevation : {0.0, 20.0, 40.0, 70.0})
    for (double azimuth = -180; azimuth < 180; azimuth += 3.7) {
      if (elevation > 0 && layout_.name != "7.1.4") continue;
      const Vec3f from = around(azimuth, elevation);
      const Sums sums = sums_of(layout_, panner_->gains(from));
      EXPECT_LT(length(normalize(sums.velocity) - Vec3(from)), 1e-4) << azimuth << ' ' << elevation;
    }
}

// The tangent law: at an angle a from the middle of a pair that is 2 b apart, the difference of the
// gains is t = tan a / tan b of their sum. Weighted by power, the directions add up to a vector at
// atan(2 t / (1 + t^2) tan b).
TEST_P(LayoutPanning, PointsTheEnergyOfAPairByTheTangentLaw) {
  std::vector<double> ring;
  for (const Loudspeaker& speaker : layout_.speakers)
    if (speaker.elevation_deg == 0 && speaker.speaker != Speaker::kLowFrequency)
      ring.push_back(speaker.azimuth_deg);
  std::ranges::sort(ring);
  ring.push_back(ring.front() + 360);
  constexpr double kRadians = std::numbers::pi / 180;
  for (std::size_t pair = 0; pair + 1 < ring.size(); ++pair) {
    const double middle = (ring[pair] + ring[pair + 1]) / 2, half = ring[pair + 1] - middle;
    for (double a = -half; a <= half; a += half / 8) {
      const Sums sums = sums_of(layout_, panner_->gains(around(middle + a)));
      const double t = std::tan(a * kRadians) / std::tan(half * kRadians);
      const double expected =
          middle + std::atan(2 * t / (1 + t * t) * std::tan(half * kRadians)) / kRadians;
      EXPECT_LT(length(normalize(sums.energy) - Vec3(around(expected))), 1e-4) << middle + a;
    }
  }
}

TEST_P(LayoutPanning, GivesMirroredDirectionsMirroredGains) {
  const auto mirrored = [&](std::size_t c) {
    for (std::size_t other = 0; other < layout_.speakers.size(); ++other)
      if (layout_.speakers[other].azimuth_deg == -layout_.speakers[c].azimuth_deg &&
          layout_.speakers[other].elevation_deg == layout_.speakers[c].elevation_deg &&
          (layout_.speakers[c].speaker == Speaker::kLowFrequency) ==
              (layout_.speakers[other].speaker == Speaker::kLowFrequency))
        return other;
    return c;
  };
  for (const Vec3f& from : random_directions(500)) {
    const ChannelGains left = panner_->gains(from);
    const ChannelGains right = panner_->gains({from.x, -from.y, from.z});
    for (std::size_t c = 0; c < layout_.speakers.size(); ++c)
      EXPECT_NEAR(left[c], right[mirrored(c)], 1e-4) << c;
  }
}

TEST_P(LayoutPanning, ChangesGainsContinuouslyWithTheDirection) {
  // Steps are half a degree; a pair 60 degrees apart exchanges all power in 120 of them, so no step
  // exceeds 1/20.
  for (const Vec3f& from : random_directions(2000)) {
    const Basis basis = basis_around(Vec3(from));
    const Vec3f next(normalize(Vec3(from) + std::numbers::pi / 360 * basis.tangent));
    const ChannelGains before = panner_->gains(from), after = panner_->gains(next);
    for (std::size_t c = 0; c < kMaxChannels; ++c) EXPECT_NEAR(before[c], after[c], 0.05);
  }
}

// A pair has a loudspeaker neither beside the listener nor behind.
TEST(Panner, PansAPairByTheTangentLawAheadAndKeepsThePowerAllRound) {
  const LoudspeakerLayout pair = *find_layout("stereo");
  const auto panner = make_loudspeaker_panner(pair);
  for (const Vec3f& from : random_directions(5000)) {
    const ChannelGains gains = panner->gains(from),
                       right = panner->gains({from.x, -from.y, from.z});
    EXPECT_NEAR(sums_of(pair, gains).power, 1, 1e-5);
    EXPECT_NEAR(gains[0], right[1], 1e-4);
    if (from.y > 0.1f) {
      EXPECT_GT(gains[0], gains[1]);
    }
  }
  for (double azimuth = -30; azimuth <= 30; azimuth += 3) {
    const Sums sums = sums_of(pair, panner->gains(around(azimuth)));
    EXPECT_LT(length(normalize(sums.velocity) - Vec3(around(azimuth))), 1e-4) << azimuth;
  }
}

TEST(Panner, IsSilentForTheZeroVector) {
  const auto panner = make_loudspeaker_panner(*find_layout("5.1"));
  for (const float gain : panner->gains({0, 0, 0})) EXPECT_EQ(gain, 0);
}

TEST(Panner, NamesTheKnownLayoutsInItsError) {
  const auto none = find_layout("22.2");
  ASSERT_FALSE(none.ok());
  EXPECT_NE(none.error().message.find("7.1.4"), std::string::npos);
}

}  // namespace
}  // namespace clamor
