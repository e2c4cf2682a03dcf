#include "bake/bake_plan.h"

#include <algorithm>
#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "bake/batch_tracing.h"
#include "bake/journal/journal_set.h"
#include "bake/journal/run_key.h"
#include "bake/journal/shard_note.h"
#include "bake/trace/deposit.h"
#include "bake/trace/pilot.h"
#include "bake/trace/scene.h"
#include "tests/rooms.h"

namespace clamor {
namespace {

using testing::shoebox;
using testing::uniform_material;

BakePlan plan(const Level& level, const BakeSettings& settings) {
  const Scene scene(level.mesh);
  return make_bake_plan(scene, level, settings, {});
}

Level room_with(std::size_t emitters) {
  Level level = shoebox({20, 10, 5}, uniform_material(0.2f), {1, 1, 1});
  level.emitters.resize(emitters, level.emitters[0]);
  for (std::size_t i = 0; i < emitters; ++i) {
    level.emitters[i].name = "emitter" + std::to_string(i);
    level.emitters[i].position_m = {
        1 + 18.0 * static_cast<double>(i) / static_cast<double>(emitters), 2, 2};
  }
  return level;
}

TEST(BakePlan, DistributesPhotonsByPowerWithAMinimumPerEmitter) {
  Level level = room_with(3);
  level.emitters[0].gain = 3;
  level.emitters[2].gain = 0.001;
  const BakePlan found = plan(level, {.photons = 10000});
  EXPECT_EQ(found.photons[0], 9000u);
  EXPECT_EQ(found.photons[1], 1000u);
  EXPECT_EQ(found.photons[2], kMinPhotons);
}

TEST(BakePlan, GivesSilentEmittersNoPhotons) {
  Level level = room_with(2);
  level.emitters[1].gain = 0;
  EXPECT_EQ(plan(level, {.photons = 10000}).photons[1], 0u);
}

TEST(BakePlan, ManyEmittersNeedNoMorePhotonsThanOne) {
  const std::uint64_t one = plan(room_with(1), {}).all_photons();
  const std::uint64_t many = plan(room_with(5000), {}).all_photons();
  EXPECT_LT(many, 2 * one);
}

// Eyring: a cube of 20 m without air decays by 60 dB in 26.9 s if its walls absorb 2 %, in 52.6 s
// if they absorb 1 %, and in 0.8 s if they absorb half. The plan takes the next multiple of 5 s.
TEST(BakePlan, TracesAsLongAsASlowDecayTakes_NoAsan) {
  const auto planned = [](float absorption, double asked_s) {
    return plan(shoebox({20, 20, 20}, uniform_material(absorption), {5, 5, 5}),
                {.longest_path_s = asked_s});
  };
  EXPECT_EQ(planned(0.02f, 0).longest_path_s, 30);
  EXPECT_EQ(planned(0.02f, 0).fade_s, 0) << "nothing that is heard must end";
  EXPECT_EQ(planned(0.0102f, 0).longest_path_s, 55);
  EXPECT_EQ(planned(0.5f, 0).longest_path_s, kUsualPath_s);
  EXPECT_EQ(planned(0.5f, 0).fade_s, 0);
  EXPECT_EQ(planned(0.001f, 0).longest_path_s, kLongestPath_s);
  EXPECT_GT(planned(0.001f, 0).fade_s, 0);
  EXPECT_EQ(planned(0, 0).longest_path_s, kLongestPath_s);
  EXPECT_EQ(planned(0.02f, 3).longest_path_s, 3) << "not as asked for";
  EXPECT_GT(planned(0.02f, 3).fade_s, 0);
  EXPECT_EQ(planned(0.02f, 10).longest_path_s, 10) << "not as asked for";
  EXPECT_EQ(planned(0.5f, 60).longest_path_s, 60) << "not as asked for";
}

TEST(BakePlan, CountsRoomsByVisibilityBetweenEmitters) {
  // Two separate boxes with a gap between them.
  Level level = room_with(2);
  Mesh other = testing::box({20, 10, 5});
  const auto first = static_cast<std::uint32_t>(level.mesh.vertices_m.size());
  for (Vec3f& vertex : other.vertices_m) level.mesh.vertices_m.push_back(vertex + Vec3f(21, 0, 0));
  for (auto triangle : other.triangles) {
    for (auto& corner : triangle) corner += first;
    level.mesh.triangles.push_back(triangle);
    level.mesh.materials.push_back(0);
  }
  EXPECT_EQ(plan(level, {}).rooms, 1u);
  EXPECT_EQ(plan(level, {}).sources, 200000u);
  level.emitters[1].position_m = {30, 5, 2};
  EXPECT_EQ(plan(level, {}).rooms, 2u);
  EXPECT_EQ(plan(level, {}).sources, 400000u);
}

TEST(BakePlan, KeepsSourcesForAtMost32RoomsByDefault) {
  // A row of forty cells with an emitter in each.
  Level level = room_with(40);
  level.mesh = testing::box({80, 2, 2});
  for (int cell = 0; cell < 40; ++cell) {
    if (cell > 0) testing::add_wall_across(level.mesh, 2 * cell, {80, 2, 2}, 0);
    level.emitters[static_cast<std::size_t>(cell)].position_m = {2.0 * cell + 1, 1, 1};
  }
  EXPECT_EQ(plan(level, {}).rooms, 40u);
  EXPECT_EQ(plan(level, {}).sources, 6'400'000u);
  EXPECT_EQ(plan(level, {.sources = 8'000'000}).sources, 8'000'000u);
}

TEST(BakePlan, ThinsWhileTracingOnlyIfDepositsFarExceedSources) {
  EXPECT_EQ(plan(room_with(1), {.photons = 100, .sources = 100000}).deposit_threshold, 0);
  const double some = plan(room_with(1), {.photons = 100000, .sources = 10000}).deposit_threshold;
  const double more = plan(room_with(1), {.photons = 1000000, .sources = 10000}).deposit_threshold;
  EXPECT_GT(some, 0);
  EXPECT_GT(more, 5 * some);
}

TEST(BakePlan, MovingOneOfFiftyEmittersLeavesTheOthersPhotonsUnchanged) {
  Level level = room_with(50);
  const BakePlan before = plan(level, {});
  level.emitters[17].position_m = {15, 8, 4};
  const BakePlan after = plan(level, {});
  EXPECT_EQ(before.photons, after.photons);
  EXPECT_EQ(before.deposit_threshold, after.deposit_threshold);
}

TEST(BakePlan, BatchesContainEveryPhotonOnceWithinTheirLimit) {
  BakePlan some;
  some.photons = {5, 0, 2000, 1024, 300, 4, 4, 4000};
  std::vector<std::uint64_t> next(some.photons.size(), 0);
  for (const auto& batch : some.batches()) {
    std::uint64_t photons = 0;
    for (const PhotonRun& run : batch) {
      EXPECT_EQ(run.first, next[run.emitter]);
      next[run.emitter] += run.count;
      photons += run.count;
    }
    EXPECT_LE(photons, kRunPhotons);
  }
  EXPECT_EQ(next, some.photons);
}

BakePlan estimated(double threshold, float decay_m) {
  BakePlan plan;
  plan.deposit_threshold = threshold;
  plan.decay.early_m = plan.decay.knee_m = plan.decay.late_m = same_in_all_bands(decay_m);
  return plan;
}

TEST(BakePlan, KeepsEstimatesThatDifferByAStepOfTheirRounding) {
  const auto kept_with = [](const BakePlan& earlier, BakePlan plan) {
    keep_estimates(plan, earlier);
    return std::pair(plan.deposit_threshold, plan.decay.late_m[3]);
  };
  const BakePlan earlier = estimated(4, 20);
  EXPECT_EQ(kept_with(earlier, estimated(4 / Pilot::kThresholdStep, 15)), std::pair(4.0, 20.0f));
  EXPECT_EQ(kept_with(earlier, estimated(4 * Pilot::kThresholdStep, 30)), std::pair(4.0, 20.0f));
  EXPECT_EQ(kept_with(earlier, estimated(4, 10)), std::pair(4.0, 10.0f)) << "another room";
  EXPECT_EQ(kept_with(earlier, estimated(8, 30)), std::pair(8.0, 30.0f)) << "more photons";
  BakePlan one_band = estimated(4, 20);
  one_band.decay.knee_m[7] = 40;
  EXPECT_EQ(kept_with(earlier, one_band), std::pair(4.0, 20.0f));
  EXPECT_EQ(one_band.decay.knee_m[7], 40);
  BakePlan longer = estimated(2, 15);
  longer.longest_path_s = 15;
  EXPECT_EQ(kept_with(earlier, longer), std::pair(2.0, 15.0f)) << "longer paths";
  // What has not been estimated is not kept.
  EXPECT_EQ(kept_with({}, estimated(4, 20)), std::pair(4.0, 20.0f));
  EXPECT_EQ(kept_with(earlier, {}), std::pair(0.0, 0.0f));
}

// --- The arithmetic of large bakes: a thousand million photons and more, of which none is traced
// --

constexpr std::uint64_t kThousandMillion = 1'000'000'000;

struct LargeBakeRoom {
  LargeBakeRoom() { level.emitters[0].name = "source"; }

  Level level = testing::shoebox({6, 8, 3}, testing::uniform_material(0.2f), {1, 1, 1});
  Scene scene{level.mesh};
  TraceSettings settings;
  PhotonTracer tracer{scene, level, settings};
};

TEST(BatchTracing, SharesAThousandMillionPhotonsOutAmongShardsWithoutLosingOne_NoAsan) {
  const LargeBakeRoom room;
  BakePlan plan;
  plan.photons = {kThousandMillion + 7};
  plan.sources = 1000;
  const BakeOptions options;
  OpenJournals none;
  JournalSet journals(none, RunKeys(room.level, room.tracer, 0));
  std::uint64_t all = 0;
  for (const std::uint32_t shard : {0u, 1u, 2u}) {
    const BatchTracing tracing(room.tracer, plan, options, journals, {shard, 3});
    const std::uint64_t photons = tracing.progress().photons_total;
    // Shards differ by one batch at most, and by what is left of the last.
    EXPECT_NEAR(static_cast<double>(photons), kThousandMillion / 3.0, 2 * kRunPhotons);
    all += photons;
  }
  EXPECT_EQ(all, kThousandMillion + 7);
}

// Emitters of one name, place and key, so that only the photons' indices tell runs apart.
TEST(BatchTracing, TracesOtherPhotonsBeyondTheIndicesOf32Bits) {
  const LargeBakeRoom room;
  const std::uint64_t beyond = (std::uint64_t{1} << 32) + 5 * kRunPhotons;
  const std::vector<PhotonRun> runs = {{0, 5 * kRunPhotons, 64}, {0, beyond, 64}};
  TracedRuns traced;
  room.tracer.trace(runs, traced);
  ASSERT_EQ(traced.runs().size(), 2u);
  const auto first = traced.deposits_of(traced.runs()[0]),
             second = traced.deposits_of(traced.runs()[1]);
  EXPECT_FALSE(std::equal(first.begin(), first.end(), second.begin(), second.end(),
                          [](const Deposit& a, const Deposit& b) { return a.random == b.random; }));
  const auto key = [&](const PhotonRun& run) {
    return run_key(1, room.level.emitters[0], room.tracer.emitter_key(0), nullptr, run);
  };
  EXPECT_NE(key(runs[0]), key(runs[1]));
}

TEST(BakePlan, NumbersTheRunsOfAThousandMillionPhotonsOfEachOfSixEmitters) {
  BakePlan plan;
  plan.photons.assign(6, kThousandMillion);
  EXPECT_EQ(plan.all_photons(), 6 * kThousandMillion);  // beyond 32 bits
  plan.photons.resize(1);
  const auto batches = plan.batches();
  EXPECT_EQ(batches.size(), (kThousandMillion + kRunPhotons - 1) / kRunPhotons);
  const PhotonRun& last = batches.back().back();
  EXPECT_EQ(last.first + last.count, kThousandMillion);
}

// The emitter's power is shared by its photons, and each deposit is a thinned part of one of them.
TEST(SecondarySource, KeepsItsShareOfAThousandMillionPhotons) {
  Deposit deposit;
  deposit.power = same_in_all_bands(1e-6f);  // -60 dB
  const Source source = secondary_source(deposit, 1 / static_cast<double>(kThousandMillion));
  for (const float power : source.power)
    EXPECT_NEAR(static_cast<double>(power) * kThousandMillion, 1e-6, 1e-12);
}

TEST(ShardProgress, CountsPhotonsBeyond32Bits) {
  ShardProgress progress;
  progress.host = "farm1";
  progress.photons = 7 * kThousandMillion;
  progress.traced = 6 * kThousandMillion;
  const auto read = ShardProgress::from(progress.text());
  ASSERT_TRUE(read);
  EXPECT_EQ(read->photons, 7 * kThousandMillion);
  EXPECT_EQ(read->traced, 6 * kThousandMillion);
}

}  // namespace
}  // namespace clamor
