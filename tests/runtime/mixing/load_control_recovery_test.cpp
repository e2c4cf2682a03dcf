// load_control_recovery_test.cpp: the closed loop of load_control.h and a simulated machine. How
// soon do all voices return after a burden, how many keyframes and blocks are late meanwhile, and
// does the number of voices oscillate?
//
// A keyframe takes fixed + k x per_voice of its period, and a block the same of its own; both are
// multiplied by a burden, which comes and goes, and by a few percent of noise. A burden is the
// threads' own load. Other programs leave the threads a share of a core.
#include <algorithm>
#include <cmath>
#include <functional>

#include <gtest/gtest.h>

#include "common/random.h"
#include "runtime/mixing/load_control.h"

namespace clamor {
namespace {

constexpr std::size_t kMost = 2000;
constexpr double kPeriod_s = 0.02;
constexpr int kBlocksPerKeyframe = 4;

// Shares of the period, without a burden.
struct Costs {
  double fixed = 0.1, voices = 0.3;  // of all voices
};

struct BusyMachine {
  Costs sampler{}, mixer{};
  double noise = 0.1;  // relative amplitude
  SamplerLoadControl limit{kMost};
  MixerLoadControl load{};
  double core = 1;  // the share that other programs leave
  std::size_t late_blocks = 0;
  double lowest = 1, now_s = 0;
  std::size_t turns = 0;  // changes of direction of k, by more than 5 %
  double min_since = kMost, max_since = kMost;
  bool falling = false;
  std::uint32_t draws = 0;

  double took(const Costs& costs, std::size_t voices, double burden) {
    const double random = unit(philox(5, {draws++, 0, 0, 0})[0]);
    const double share = static_cast<double>(voices) / kMost;
    return burden * (costs.fixed + costs.voices * share) * (1 + noise * (2 * random - 1));
  }

  // Runs both threads; burden(now) multiplies the time that each takes.
  void run(double seconds, const std::function<double(double)>& sampling,
           const std::function<double(double)>& mixing) {
    for (const double end_s = now_s + seconds; now_s < end_s; now_s += kPeriod_s) {
      const std::size_t chosen = limit.voices();
      std::size_t left_out = 0;
      for (int block = 0; block < kBlocksPerKeyframe; ++block) {
        load.expect(chosen);
        const std::size_t mixed = std::min(chosen, load.allowed());
        left_out = chosen - mixed;
        const double share = took(mixer, mixed, mixing(now_s));
        late_blocks += share > 1;
        const double block_s = kPeriod_s / kBlocksPerKeyframe;
        load.mixed({share / core * block_s, share * block_s}, block_s, mixed);
      }
      const Costs costs{sampler.fixed / static_cast<double>(limit.spacing()), sampler.voices};
      const double share = took(costs, chosen, sampling(now_s));
      limit.keyframe_took({share / core, share},
                          static_cast<double>(left_out) / static_cast<double>(chosen),
                          load.is_full(chosen));
      watch(static_cast<double>(limit.voices()));
    }
  }

  void watch(double k) {
    lowest = std::min(lowest, k / kMost);
    min_since = falling ? std::min(min_since, k) : min_since;
    max_since = falling ? max_since : std::max(max_since, k);
    if (falling ? k > 1.05 * min_since : k < 0.95 * max_since) {
      falling = !falling;
      ++turns;
      min_since = max_since = k;
    }
  }
  double share_of_all() const { return static_cast<double>(limit.voices()) / kMost; }
};

double none(double) { return 1; }
std::function<double(double)> always(double burden) {
  return [burden](double) { return burden; };
}

TEST(LoadControlRecovery, AllVoicesReturnWithinFourSecondsOfTheWorstBurden) {
  BusyMachine machine;
  machine.run(5, none, none);
  EXPECT_EQ(machine.limit.voices(), kMost);
  machine.run(10, always(20), none);  // no number of voices fits
  EXPECT_EQ(machine.limit.voices(), kMost / SamplerLoadControl::kFloor);
  machine.run(4, none, none);
  EXPECT_EQ(machine.limit.voices(), kMost);
}

TEST(LoadControlRecovery, AllVoicesReturnWithinFourSecondsOfABurdenOfTheMixer) {
  BusyMachine machine;
  machine.run(5, none, none);
  machine.run(10, none, always(8));  // 0.8 of the period without any voice
  EXPECT_LT(machine.lowest, 0.1);
  machine.run(4, none, none);
  EXPECT_EQ(machine.limit.voices(), kMost);
  EXPECT_EQ(machine.load.allowed(), MixerLoadControl::kUnlimited);
}

// With a burden of 2.5 a keyframe takes 1.0 of its period, and with 5 it takes 2.0; each late
// keyframe halves the number of voices at most. So a step is late once or twice.
TEST(LoadControlRecovery, AStepOfLoadIsLateOnceOrTwiceAndSettlesWithinASecond) {
  for (const double burden : {2.5, 4.0, 5.0}) {
    BusyMachine machine{.noise = 0.03};
    machine.run(5, none, none);
    machine.run(1, always(burden), none);
    EXPECT_LE(machine.limit.late(), burden < 4 ? 1u : 2u) << burden;
    const double settled = machine.share_of_all();
    const double took = burden * (0.1 + 0.3 * settled);
    EXPECT_LT(took, kHighShare) << burden;
    EXPECT_GT(took, kLowShare * 0.9) << burden;
    machine.run(60, always(burden), none);
    EXPECT_NEAR(machine.share_of_all(), settled, 0.08) << burden;
    EXPECT_LE(machine.limit.late(), burden < 4 ? 1u : 2u) << burden;
    EXPECT_LE(machine.turns, 2u) << burden;
  }
}

TEST(LoadControlRecovery, TheNumberOfVoicesDoesNotOscillateUnderASteadyLoad_NoAsan) {
  for (double burden = 1; burden < 12; burden *= 1.07)
    for (const bool mixes : {false, true}) {
      BusyMachine machine{.noise = 0.15};
      machine.run(8, mixes ? none : always(burden), mixes ? always(burden) : none);
      machine.turns = 0;
      machine.late_blocks = 0;
      const std::uint64_t late = machine.limit.late();
      machine.run(60, mixes ? none : always(burden), mixes ? always(burden) : none);
      EXPECT_LE(machine.turns, 2u) << burden << (mixes ? " of the mixer" : "");
      // Beyond a burden of 7, the fixed cost of a keyframe with the fewest voices takes the whole
      // period.
      if (burden < 7) {
        EXPECT_EQ(machine.limit.late(), late) << burden;
        EXPECT_EQ(machine.late_blocks, 0u) << burden;
      }
    }
}

// The limit waits longer after each return; otherwise every return of the burden would find all
// voices there.
TEST(LoadControlRecovery, AnIntermittentBurdenKeepsTheLimitLow) {
  for (const double every_s : {1.0, 2.0}) {
    BusyMachine machine{.noise = 0.03};
    const auto on_and_off = [&](double now_s) {
      return std::fmod(now_s, every_s) < every_s / 2 ? 5.0 : 1.0;
    };
    machine.run(20, on_and_off, none);
    const std::uint64_t late = machine.limit.late();
    machine.turns = 0;
    machine.run(60, on_and_off, none);
    // There are 60 / every_s returns, and each of the first ones makes two keyframes late; later,
    // at most one in 4 s finds many voices.
    EXPECT_LE(machine.limit.late() - late, 2 * 60 / Backoff::kMaxWait_s) << every_s;
    // The wait leaves time for the rise from a quarter of the voices, 1.4 s.
    EXPECT_LE(machine.turns, 2 * 60 / (Backoff::kReturn_s - 1.4)) << every_s;
    machine.run(8, none, none);
    EXPECT_EQ(machine.limit.voices(), kMost) << every_s;
  }
}

TEST(LoadControlRecovery, OneLateKeyframeHalvesTheVoicesForASecondAndAHalf) {
  BusyMachine machine;
  machine.run(5, none, none);
  machine.run(kPeriod_s, always(50), none);
  EXPECT_EQ(machine.limit.voices(), kMost / 2);
  machine.run(1.5, none, none);
  EXPECT_EQ(machine.limit.voices(), kMost);
  EXPECT_EQ(machine.limit.late(), 1u);
}

// Own work of 30 % needs 60 % of the time where others take every second slice.
TEST(LoadControlRecovery, OthersThatLeaveEnoughOfTheCoreCostNoVoices) {
  for (const double core : {0.9, 0.7, 0.5}) {
    BusyMachine machine{{0.1, 0.2}, {0.1, 0.2}};
    machine.core = core;
    machine.run(60, none, none);
    EXPECT_EQ(machine.lowest, 1) << core;
    EXPECT_EQ(machine.load.allowed(), MixerLoadControl::kUnlimited) << core;
  }
}

// The work that is left takes between kLowShare and kHighShare of the time that passes, and all
// voices return after that.
TEST(LoadControlRecovery, VoicesFallAsFarAsTheShareOfTheCoreDemandsAndReturnWithinFourSeconds) {
  for (const double own : {0.6, 0.9, 1.5})
    for (const double core : {0.3, 0.5}) {
      BusyMachine machine{{0.02, own - 0.02}, {0.05, 0.05}, 0.03};
      machine.run(5, none, none);
      machine.core = core;
      machine.run(5, none, none);
      const double settled = machine.share_of_all();
      const double passes = (0.02 + (own - 0.02) * settled) / core;
      EXPECT_GT(passes, kLowShare * 0.95) << own << " at " << core;
      EXPECT_LT(passes, kHighShare * 1.05) << own << " at " << core;
      machine.turns = 0;
      machine.run(60, none, none);
      EXPECT_LE(machine.turns, 2u) << own << " at " << core;
      EXPECT_NEAR(machine.share_of_all(), settled, 0.1) << own << " at " << core;
      machine.core = 1;
      machine.run(4, always(0.4 / own), none);
      EXPECT_EQ(machine.limit.voices(), kMost) << own << " at " << core;
    }
}

// A keyframe takes 0.4 / n + 0.1 of its period if n of them share a sample. Where others leave 0.45
// of a core that is 1.11, or 0.67 of two; a burden of 2.5 makes it 1.25, or 0.75 of two.
TEST(LoadControlRecovery, KeyframesShareSamplesBeforeVoicesFall) {
  for (const bool others : {true, false}) {
    BusyMachine machine{{0.4, 0.1}, {0.05, 0.05}, 0.03, SamplerLoadControl(kMost, {1, 5})};
    machine.run(5, none, none);
    EXPECT_EQ(machine.limit.spacing(), 1u);
    machine.core = others ? 0.45 : 1;
    machine.run(60, always(others ? 1 : 2.5), none);
    EXPECT_EQ(machine.limit.spacing(), 2u);
    EXPECT_EQ(machine.lowest, 1);
    machine.core = 1;
    machine.run(4, none, none);
    EXPECT_EQ(machine.limit.spacing(), 1u);
  }
}

// Where there are many walls, choosing takes 0.7 of the time however few voices there are.
TEST(LoadControlRecovery, VoicesThatTheMixerShedReturnAlthoughChoosingLeavesLittleRoom) {
  BusyMachine machine{{0.7, 0.1}, {0.05, 0.25}, 0.03, SamplerLoadControl(kMost, {1, 5})};
  machine.run(5, none, none);
  EXPECT_EQ(machine.limit.voices(), kMost);
  machine.run(5, none, always(8));
  EXPECT_LT(machine.lowest, 0.5);
  machine.run(4, none, none);
  EXPECT_EQ(machine.limit.voices(), kMost);
  EXPECT_EQ(machine.limit.late(), 0u);
}

TEST(LoadControlRecovery, AStallByOthersCostsNoVoices) {
  BusyMachine machine;
  machine.run(5, none, none);
  machine.core = 0.3 / 50;  // 50 periods for one keyframe
  machine.run(kPeriod_s, none, none);
  machine.core = 1;
  machine.run(5, none, none);
  EXPECT_EQ(machine.lowest, 1);
  EXPECT_EQ(machine.limit.late(), 1u);
  EXPECT_EQ(machine.limit.starved(), 1u);
}

}  // namespace
}  // namespace clamor
