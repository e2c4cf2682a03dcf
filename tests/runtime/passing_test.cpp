// passing_test.cpp: when something that passes is loudest, and when its pitch falls: what filters
// lie on the way must move neither.
#include <algorithm>
#include <cmath>
#include <complex>
#include <limits>
#include <numbers>

#include <gtest/gtest.h>

#include "tests/rooms.h"
#include "tests/runtime/heads.h"
#include "tests/runtime/moving_field.h"

namespace clamor {
namespace {

// The octaves' filters take 0.8 ms at this tone (mixer.h), a head's none.
constexpr double kTone_hz = 2000, kSpeed_mps = 30, kNearest_m = 3;
// Neither at a keyframe nor half-way between two.
constexpr double kPasses_s = 1.0073;

enum class Output : std::uint8_t { kTwoReceivers, kBinaural };

struct Case {
  Output output;
  bool limit;           // holds everything back by 1.5 ms
  bool listener_rides;  // otherwise the source does
};

double x_m(double t) { return kSpeed_mps * (t - kPasses_s); }

// What the left ear hears.
std::vector<float> ride_past(const Case& ride) {
  AuralizerInput input;
  AuralizerOptions options;
  options.limit = ride.limit;
  options.moving.most = 1;
  options.moving.signals = {testing::sine(kTone_hz)};
  options.moving.kinds = {{"tone", 0, {}}};
  if (ride.output == Output::kBinaural) {
    options.output.kind = OutputShape::Kind::kBinaural;
    options.output.head = std::make_shared<const Head>(testing::no_head());
  }
  auto auralizer = Auralizer::create(std::move(input), options);
  if (!auralizer.ok()) return {};
  MovingSources& moving = *(*auralizer)->moving();
  const auto source = *moving.add({.position_m = {0, 0, -kNearest_m}});
  std::vector<float> left, block(2 * kKeyframeFrames);
  while (left.size() < std::size_t{2} * kSampleRate_hz) {
    while ((*auralizer)->wants_keyframe()) {
      const double x = x_m((*auralizer)->next_keyframe_time_s());
      const double source_x = ride.listener_rides ? 0 : x;
      EXPECT_TRUE(moving.move(source, {source_x, 0, -kNearest_m}).ok());
      moving.commit();
      (*auralizer)->make_keyframe({{ride.listener_rides ? -x : 0, 0, 0}, 0, 0});
    }
    (*auralizer)->mix(block);
    for (std::size_t f = 0; f < block.size(); f += 2) left.push_back(block[f]);
  }
  return left;
}

// By how much later than `meant(t)` what is `heard(t)` happens: the shift at which they fit best,
// in a fifth of a second round the moment, whatever the factor between them.
template <class Heard, class Meant>
double late_s(const Heard& heard, const Meant& meant) {
  double least = std::numeric_limits<double>::infinity(), late = 0;
  std::vector<double> is;
  for (int i = -100; i <= 100; ++i) is.push_back(heard(kPasses_s + 1e-3 * i));
  for (double shift = -0.03; shift <= 0.03; shift += 5e-5) {
    double xx = 0, xy = 0, yy = 0;
    for (int i = -100; i <= 100; ++i) {
      const double x = meant(kPasses_s + 1e-3 * i - shift),
                   y = is[static_cast<std::size_t>(i + 100)];
      xx += x * x, xy += x * y, yy += y * y;
    }
    if (const double error = yy - xy * xy / xx; error < least) {
      least = error;
      late = shift;
    }
  }
  return late;
}

class Passing : public ::testing::TestWithParam<Case> {};

TEST_P(Passing, IsLoudestAndFallsInPitchWhenItIsNearest) {
  const std::vector<float> left = ride_past(GetParam());
  ASSERT_FALSE(left.empty());
  const double ear_m = GetParam().output == Output::kTwoReceivers ? kEarDistance_m / 2 : 0;
  const auto distance_m = [&](double t) { return std::hypot(x_m(t) + ear_m, kNearest_m); };
  // The tone's amplitude and phase in 6 ms round a moment.
  const auto tone = [&](double t) {
    constexpr int kReach = 144;
    const int middle = static_cast<int>(std::lround(t * kSampleRate_hz));
    std::complex<double> sum = 0;
    for (int k = -kReach; k <= kReach; ++k) {
      const double window = 1 + std::cos(std::numbers::pi * k / (kReach + 1));
      const double at = 1.0 * (middle + k) / kSampleRate_hz;
      // At the pitch that it should have there, or a window of 6 ms would be too long.
      const double lag_s = distance_m(at) / speed_of_sound_mps(Air{});
      sum += window * static_cast<double>(left[static_cast<std::size_t>(middle + k)]) *
             std::polar(1.0, -2 * std::numbers::pi * kTone_hz * (at - lag_s));
    }
    return sum;
  };
  const double level_late_s = late_s([&](double t) { return std::abs(tone(t)); },
                                     [&](double t) { return 1 / distance_m(t); });
  const auto meant_lag_s = [&](double t) { return distance_m(t) / speed_of_sound_mps(Air{}); };
  const auto slope = [](const auto& lag_s, double t) { return lag_s(t + 5e-4) - lag_s(t - 5e-4); };
  const auto pitch_shift = [&](double t) {
    const double turned = std::arg(tone(t + 5e-4) / tone(t - 5e-4));
    return slope(meant_lag_s, t) - turned / (2 * std::numbers::pi * kTone_hz);
  };
  const double pitch_late_s = late_s(pitch_shift, [&](double t) { return slope(meant_lag_s, t); });
  EXPECT_NEAR(level_late_s, 0, 1e-3);
  EXPECT_NEAR(pitch_late_s, 0, 1e-3);
}

INSTANTIATE_TEST_SUITE_P(Something, Passing,
                         ::testing::Values(Case{Output::kTwoReceivers, false, true},
                                           Case{Output::kTwoReceivers, true, false},
                                           Case{Output::kBinaural, false, true},
                                           Case{Output::kBinaural, true, false}));

}  // namespace
}  // namespace clamor
