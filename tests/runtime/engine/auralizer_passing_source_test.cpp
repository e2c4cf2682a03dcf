// auralizer_passing_source_test.cpp: the times at which a passing source is loudest and its pitch
// falls. The mixer compensates the delay of its filters, so they must shift neither time and change
// no pitch.
#include <algorithm>
#include <cmath>
#include <complex>
#include <limits>
#include <numbers>

#include <gtest/gtest.h>

#include "runtime/engine/auralizer_input.h"
#include "runtime/engine/auralizer_options.h"
#include "runtime/mixing/keyframe_maker.h"
#include "tests/rooms.h"
#include "tests/runtime/hrtf_mixing.h"
#include "tests/runtime/moving_field.h"

namespace clamor {
namespace {

constexpr double kSourceSpeed_mps = 30;
// Closest approach: neither at a keyframe nor half-way between two.
constexpr double kPasses_s = 1.0073;

enum class PassingOutput : std::uint8_t { kTwoReceivers, kBinaural };

struct Case {
  PassingOutput output;
  bool limit;           // delays the output by 1.5 ms
  bool listener_rides;  // otherwise the source moves
  // The octave filters delay this tone by 0.8 ms (mixer.h), an HRTF by nothing.
  double tone_hz = 2000, nearest_m = 3;
};

double x_m(double t) { return kSourceSpeed_mps * (t - kPasses_s); }

// Signal at the left ear.
std::vector<float> ride_past(const Case& ride) {
  AuralizerInput input;
  AuralizerOptions options;
  options.limit = ride.limit;
  options.moving.max_sources = 1;
  options.moving.signals = {testing::sine(ride.tone_hz)};
  options.moving.kinds = {{"tone", 0, {}}};
  if (ride.output == PassingOutput::kBinaural) {
    options.output.kind = OutputFormat::Kind::kBinaural;
    options.output.head = std::make_shared<const Hrtf>(testing::no_head());
  }
  auto auralizer = Auralizer::create(std::move(input), options);
  if (!auralizer.ok()) return {};
  MovingSources& moving = *(*auralizer)->moving();
  const auto source = *moving.add({.position_m = {0, 0, -ride.nearest_m}});
  std::vector<float> left, block(2 * kKeyframeFrames);
  while (left.size() < std::size_t{2} * kSampleRate_hz) {
    while ((*auralizer)->wants_keyframe()) {
      const double x = x_m((*auralizer)->next_keyframe_time_s());
      const double source_x = ride.listener_rides ? 0 : x;
      EXPECT_TRUE(moving.move(source, {source_x, 0, -ride.nearest_m}).ok());
      moving.commit();
      (*auralizer)->make_keyframe({{ride.listener_rides ? -x : 0, 0, 0}, 0, 0});
    }
    (*auralizer)->mix(block);
    for (std::size_t f = 0; f < block.size(); f += 2) left.push_back(block[f]);
  }
  return left;
}

// Delay of `measured(t)` against `expected(t)`: the shift that fits best in least squares over a
// fifth of a second around the closest approach, for any factor between the two.
template <class Measured, class Expected>
double late_s(const Measured& measured, const Expected& expected) {
  double least = std::numeric_limits<double>::infinity(), late = 0;
  std::vector<double> is;
  for (int i = -100; i <= 100; ++i) is.push_back(measured(kPasses_s + 1e-3 * i));
  for (double shift = -0.03; shift <= 0.03; shift += 5e-5) {
    double xx = 0, xy = 0, yy = 0;
    for (int i = -100; i <= 100; ++i) {
      const double x = expected(kPasses_s + 1e-3 * i - shift),
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

// Expected and rendered signal at the left ear.
class Ride {
 public:
  explicit Ride(const Case& ride) : ride_(ride), left_(ride_past(ride)) {}

  bool plays() const { return !left_.empty(); }

  double distance_m(double t) const { return meant_lag_s(t) * speed_of_sound_mps(Air{}); }
  double meant_lag_s(double t) const {
    const double ear_m = ride_.output == PassingOutput::kTwoReceivers ? kEarDistance_m / 2 : 0;
    const Vec3 source_m(x_m(t) + ear_m, 0, ride_.nearest_m);
    if (ride_.listener_rides) return length(source_m) / speed_of_sound_mps(Air{});
    return testing::delay_of_moving_s(source_m, {kSourceSpeed_mps, 0, 0}, {});
  }
  // Relative decrease of the frequency.
  double meant_pitch_shift(double t) const {
    return (meant_lag_s(t + kHalf_s) - meant_lag_s(t - kHalf_s)) / (2 * kHalf_s);
  }

  double level(double t) const { return std::abs(tone(t)); }
  double pitch_shift(double t) const {
    const double turned = std::arg(tone(t + kHalf_s) / tone(t - kHalf_s));
    return meant_pitch_shift(t) - turned / (4 * std::numbers::pi * kHalf_s * ride_.tone_hz);
  }

 private:
  static constexpr double kHalf_s = 5e-4;

  // Amplitude and phase of the tone in 12 periods around `t`.
  std::complex<double> tone(double t) const {
    const int reach = static_cast<int>(6 * kSampleRate_hz / ride_.tone_hz);
    const int middle = static_cast<int>(std::lround(t * kSampleRate_hz));
    std::complex<double> sum = 0;
    for (int k = -reach; k <= reach; ++k) {
      const double window = 1 + std::cos(std::numbers::pi * k / (reach + 1));
      const double at = 1.0 * (middle + k) / kSampleRate_hz;
      // Demodulates at the expected frequency, since the frequency changes over so many periods.
      sum += window * static_cast<double>(left_[static_cast<std::size_t>(middle + k)]) *
             std::polar(1.0, -2 * std::numbers::pi * ride_.tone_hz * (at - meant_lag_s(at)));
    }
    return sum;
  }

  const Case ride_;
  const std::vector<float> left_;
};

class PassingSource : public ::testing::TestWithParam<Case> {};

TEST_P(PassingSource, IsLoudestAndFallsInPitchAtItsClosestApproach) {
  const Ride ride(GetParam());
  ASSERT_TRUE(ride.plays());
  const double level_late_s = late_s([&](double t) { return ride.level(t); },
                                     [&](double t) { return 1 / ride.distance_m(t); });
  const double pitch_late_s = late_s([&](double t) { return ride.pitch_shift(t); },
                                     [&](double t) { return ride.meant_pitch_shift(t); });
  EXPECT_NEAR(level_late_s, 0, 1e-3);
  EXPECT_NEAR(pitch_late_s, 0, 1e-3);
}

// The band filters delay low tones by a constant, which changes no frequency.
TEST(PassingSourcePitch, FollowsTheDopplerFormulaUpToTheDelayOfTheFilters) {
  for (const double tone_hz : {250.0, 500.0, 1000.0, 2000.0, 4000.0}) {
    const Ride ride({PassingOutput::kTwoReceivers, false, true, tone_hz, 5});
    ASSERT_TRUE(ride.plays());
    const double late = late_s([&](double t) { return ride.pitch_shift(t); },
                               [&](double t) { return ride.meant_pitch_shift(t); });
    double most = 0;
    for (double t = 0.2; t < 1.8; t += 2e-3)
      most = std::max(most, std::abs(ride.pitch_shift(t) - ride.meant_pitch_shift(t - late)));
    EXPECT_LT(most, 1e-3) << tone_hz << " Hz";
    EXPECT_LT(std::abs(late), 4 / tone_hz) << tone_hz << " Hz";
  }
}

INSTANTIATE_TEST_SUITE_P(Something, PassingSource,
                         ::testing::Values(Case{PassingOutput::kTwoReceivers, false, true},
                                           Case{PassingOutput::kTwoReceivers, true, false},
                                           Case{PassingOutput::kBinaural, false, true},
                                           Case{PassingOutput::kBinaural, true, false}));

}  // namespace
}  // namespace clamor
