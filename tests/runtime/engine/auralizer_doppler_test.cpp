// auralizer_doppler_test.cpp: the pitch of moving sources and for moving listeners.
#include <algorithm>
#include <cmath>
#include <complex>
#include <cstdint>
#include <memory>
#include <numbers>
#include <vector>

#include <gtest/gtest.h>

#include "runtime/engine/auralizer_input.h"
#include "runtime/engine/auralizer_options.h"
#include "runtime/mixing/keyframe_maker.h"
#include "tests/rooms.h"
#include "tests/runtime/hrtf_mixing.h"
#include "tests/runtime/moving_field.h"

namespace clamor {
namespace {

using testing::empty_field;
using testing::heard;
using testing::place_in_room;

constexpr double kTone_hz = 1000, kSpeed_mps = 30, kNearest_m = 8;

double delay_s(double t) {
  return testing::delay_of_moving_s({kSpeed_mps * (t - 1), 0, -kNearest_m}, {kSpeed_mps, 0, 0},
                                    {-kEarDistance_m / 2, 0, 0});
}

// Largest relative error of the frequency against a tone with the given delay, from the phases of 6
// ms windows 3 ms apart.
template <class Delay>
double worst_pitch_error(const std::vector<float>& out, const Delay& meant_delay_s,
                         double from_s = 0.08) {
  const auto wrong_phase = [&](std::size_t first) {
    std::complex<double> is = 0, meant = 0;
    for (std::size_t n = first; n < first + 288; ++n) {
      const double t = static_cast<double>(n) / kSampleRate_hz;
      const double window = std::sin(std::numbers::pi * static_cast<double>(n - first) / 288);
      const double phase = 2 * std::numbers::pi * kTone_hz * (t - meant_delay_s(t));
      const auto back = std::polar(window * window, -phase);
      is += static_cast<double>(out[n]) * back;
      meant += std::sin(phase) * back;
    }
    return std::arg(is / meant);
  };
  double worst_hz = 0;
  for (auto n = static_cast<std::size_t>(from_s * kSampleRate_hz); n + 432 < out.size(); n += 144) {
    const double turned =
        std::remainder(wrong_phase(n + 144) - wrong_phase(n), 2 * std::numbers::pi);
    worst_hz = std::max(worst_hz, std::abs(turned) / (2 * std::numbers::pi) * kSampleRate_hz / 144);
  }
  return worst_hz / kTone_hz;
}

MovingSource passing(double t) {
  MovingSource source;
  source.position_m = {kSpeed_mps * (t - 1), 0, -kNearest_m};
  source.velocity_mps = {kSpeed_mps, 0, 0};
  return source;
}

TEST(MovingSources, HaveTheDopplerShiftOfAPassingSource) {
  const auto auralizer = empty_field({testing::sine(kTone_hz)}, 10);
  MovingSources& moving = *auralizer->moving();
  const auto car = *moving.add(passing(0));
  const auto out = heard(*auralizer, 2, [&](double t) {
    ASSERT_TRUE(moving.move(car, passing(t).position_m).ok());
    moving.commit();
  });
  // The sound emitted before the first move comes from a source at rest.
  EXPECT_LT(worst_pitch_error(out, delay_s, 0.2), 0.001);
}

TEST(MovingSources, HaveThatShiftInAGameAtSixtyFramesPerSecond) {
  const auto auralizer = empty_field({testing::sine(kTone_hz)}, 10);
  MovingSources& moving = *auralizer->moving();
  const auto car = *moving.add(passing(0));
  const auto out = heard(*auralizer, 2, [&](double t) {
    const double frame_s = std::floor(t * 60) / 60;
    ASSERT_TRUE(moving.move(car, passing(frame_s).position_m, {kSpeed_mps, 0, 0}).ok());
    moving.commit(frame_s);
  });
  EXPECT_LT(worst_pitch_error(out, delay_s), 0.001);
}

// Either the source or the listener moves past the other; the two Doppler shifts differ.
enum class Mover : std::uint8_t { kSource, kListener };
struct Drive {
  Mover mover;
  double speed_mps, nearest_m;
};

double worst_cents(const Drive& drive) {
  const Vec3 velocity_mps(drive.speed_mps, 0, 0);
  const auto moved_m = [&](double t) { return (t - 1.5) * velocity_mps; };
  const Vec3 still_m(0, 0, -drive.nearest_m);
  const bool source_moves = drive.mover == Mover::kSource;
  AuralizerOptions options;
  options.moving.max_sources = 1;
  options.moving.signals = {testing::sine(kTone_hz)};
  options.moving.kinds = {{"tone", 0, {}}};
  // HRTF filters have no phase, so nothing is delayed (mixer.h).
  options.output.kind = OutputFormat::Kind::kBinaural;
  options.output.head = std::make_shared<const Hrtf>(testing::no_head());
  const auto auralizer = std::move(*Auralizer::create(AuralizerInput{}, options));
  MovingSources& moving = *auralizer->moving();
  MovingSource source;
  source.position_m = still_m + (source_moves ? moved_m(0) : Vec3(0));
  source.velocity_mps = source_moves ? velocity_mps : Vec3(0);
  const auto handle = *moving.add(source);
  moving.commit(0);
  std::vector<float> left, block(2 * kKeyframeFrames);
  while (left.size() < std::size_t{3} * kSampleRate_hz) {
    while (auralizer->wants_keyframe()) {
      const double t = auralizer->next_keyframe_time_s();
      if (source_moves) {
        EXPECT_TRUE(moving.move(handle, still_m + moved_m(t), velocity_mps).ok());
        moving.commit(t);
      }
      auralizer->make_keyframe({source_moves ? Vec3(0) : -moved_m(t), 0, 0});
    }
    auralizer->mix(block);
    for (std::size_t f = 0; f < block.size(); f += 2) left.push_back(block[f]);
  }
  // A source that starts to move at once has jumped, and crossfades for 0.1 s.
  const auto delay_s = [&](double t) {
    if (source_moves)
      return testing::delay_of_moving_s(still_m + moved_m(t), velocity_mps, Vec3(0));
    return testing::delay_of_moving_s(still_m, Vec3(0), -moved_m(t));
  };
  const double worst = worst_pitch_error(left, delay_s, 0.25);
  return 1200 * std::log2(1 + worst);
}

TEST(MovingSourcesDoppler, IsWithinACentOfTheoryUpTo100MetresPerSecond) {
  for (const Mover mover : {Mover::kSource, Mover::kListener})
    for (const double speed_mps : {3.0, 100.0})
      for (const double nearest_m : {200.0, 30.0})
        EXPECT_LT(worst_cents({mover, speed_mps, nearest_m}), 1)
            << (mover == Mover::kSource ? "source" : "listener") << " at " << speed_mps << " m/s, "
            << nearest_m << " m away";
}

}  // namespace
}  // namespace clamor
