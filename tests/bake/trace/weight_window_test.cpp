#include "bake/trace/weight_window.h"

#include <cmath>
#include <numeric>
#include <set>
#include <tuple>

#include <gtest/gtest.h>

#include "bake/trace/photon_tracer.h"
#include "bake/trace/pilot.h"
#include "bake/trace/scene.h"
#include "tests/rooms.h"

namespace clamor {
namespace {

// A closed room whose floor absorbs nine tenths and whose other surfaces a fiftieth: the powers of
// photons drift apart.
Level uneven_room(const Material& hard = testing::uniform_material(0.02f)) {
  Level level = testing::shoebox({6, 8, 3}, hard, {2, 1.5, 3});
  level.materials.push_back(testing::uniform_material(0.9f));
  level.mesh = testing::box({6, 8, 3}, {0, 0, 1, 0, 0, 0});
  return level;
}

// Late power of runs of 1024 photons, per photon.
std::vector<double> late_powers(const DecayModel& decay, double from_s, int runs,
                                const Level& level = uneven_room()) {
  const Scene scene(level.mesh);
  TraceSettings settings;
  settings.roulette_exponent = 0.15;
  settings.decay = decay;
  const PhotonTracer tracer(scene, level, settings);
  std::vector<double> powers;
  for (int r = 0; r < runs; ++r) {
    const PhotonRun run{0, std::uint64_t{1024} * static_cast<std::uint64_t>(r), 1024};
    TracedRuns traced;
    tracer.trace({&run, 1}, traced);
    double late = 0;
    for (const Deposit& deposit : traced.deposits())
      if (static_cast<double>(deposit.delay_s) >= from_s)
        late += static_cast<double>(deposit.power[4]) / 1024;
    powers.push_back(late);
  }
  return powers;
}

double mean(const std::vector<double>& values) {
  return std::accumulate(values.begin(), values.end(), 0.0) / static_cast<double>(values.size());
}

double deviation(const std::vector<double>& values) {
  const double middle = mean(values);
  double sum = 0;
  for (const double value : values) sum += (value - middle) * (value - middle);
  return std::sqrt(sum / static_cast<double>(values.size() - 1));
}

DecayModel decay_of_pilot(const Level& level = uneven_room()) {
  return trace_pilot(Scene(level.mesh), level, {}).decay;
}

TEST(WeightWindow, KeepsTheMeanOfALateDecayAndLowersItsSpread_NoAsan) {
  constexpr int kRuns = 48;
  constexpr double kFrom_s = 0.25;
  const auto plain = late_powers({}, kFrom_s, kRuns);
  const auto windowed = late_powers(decay_of_pilot(), kFrom_s, kRuns);
  // Five standard errors of both means.
  const double error = std::hypot(deviation(plain), deviation(windowed)) / std::sqrt(kRuns);
  EXPECT_NEAR(mean(windowed), mean(plain), 5 * error);
  EXPECT_LT(deviation(windowed) / mean(windowed), 0.6 * deviation(plain) / mean(plain));
}

TEST(WeightWindow, IsUnbiasedWithAWrongEstimateOfTheDecay_NoAsan) {
  constexpr int kRuns = 48;
  constexpr double kFrom_s = 0.1;
  const auto plain = late_powers({}, kFrom_s, kRuns);
  for (const float times : {0.3f, 3.0f}) {
    DecayModel wrong = decay_of_pilot();
    for (std::size_t b = 0; b < kBandCount; ++b) {
      wrong.early_m[b] *= times;
      wrong.late_m[b] *= times;
    }
    const auto windowed = late_powers(wrong, kFrom_s, kRuns);
    const double error = std::hypot(deviation(plain), deviation(windowed)) / std::sqrt(kRuns);
    EXPECT_NEAR(mean(windowed), mean(plain), 5 * error) << times;
  }
}

Level room_of_mirrors() {
  return uneven_room(testing::uniform_material(0.02f, 0.2f, kMirrorExponent));
}

// Two sources at one place and delay would have one polarity and be twice as loud as they should.
TEST(WeightWindow, LeavesOneDepositWhereMirrorsReflectAllCopiesOfAPhoton) {
  const Level level = room_of_mirrors();
  const Scene scene(level.mesh);
  TraceSettings settings;
  settings.roulette_exponent = 0.15;
  settings.decay = decay_of_pilot(level);
  TracedRuns traced;
  const PhotonRun run{0, 0, 1024};
  PhotonTracer(scene, level, settings).trace({&run, 1}, traced);
  std::set<std::tuple<std::uint16_t, float, float, float, float>> met;
  for (const Deposit& deposit : traced.deposits()) {
    const Vec3f& at_m = deposit.position_m;
    EXPECT_TRUE(met.emplace(deposit.photon, deposit.delay_s, at_m.x, at_m.y, at_m.z).second);
  }
  EXPECT_GT(met.size(), 5000u);
}

TEST(WeightWindow, KeepsTheMeanOfALateDecayBetweenMirrors_NoAsan) {
  constexpr int kRuns = 300;
  constexpr double kFrom_s = 0.25;
  const Level level = room_of_mirrors();
  const auto plain = late_powers({}, kFrom_s, kRuns, level);
  const auto windowed = late_powers(decay_of_pilot(level), kFrom_s, kRuns, level);
  const double error = std::hypot(deviation(plain), deviation(windowed)) / std::sqrt(kRuns);
  EXPECT_NEAR(mean(windowed), mean(plain), 5 * error);
  EXPECT_LT(error, 0.03 * mean(plain));
}

TEST(WeightWindow, GivesARunTheSameDepositsWhateverElseIsTraced) {
  const Level level = uneven_room();
  const Scene scene(level.mesh);
  TraceSettings settings;
  settings.decay = decay_of_pilot();
  const PhotonTracer tracer(scene, level, settings);
  const std::vector<PhotonRun> runs{{0, 0, 300}, {0, 1024, 300}, {0, 2048, 300}};
  TracedRuns together, alone;
  tracer.trace(runs, together);
  tracer.trace(std::span(runs).subspan(1, 1), alone);
  const auto expected = alone.deposits_of(alone.runs()[0]);
  const auto deposits = together.deposits_of(together.runs()[1]);
  ASSERT_EQ(deposits.size(), expected.size());
  for (std::size_t i = 0; i < deposits.size(); ++i) {
    EXPECT_EQ(deposits[i].position_m, expected[i].position_m);
    EXPECT_EQ(deposits[i].power, expected[i].power);
  }
}

}  // namespace
}  // namespace clamor
