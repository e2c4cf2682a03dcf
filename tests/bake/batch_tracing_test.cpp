// Tests that the arithmetic of large bakes holds: a thousand million photons and more, of which
// none is traced here.
#include "bake/batch_tracing.h"

#include <algorithm>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "bake/journal/run_key.h"
#include "bake/journal/shard_note.h"
#include "bake/trace/deposit.h"
#include "bake/trace/scene.h"
#include "tests/rooms.h"

namespace clamor {
namespace {

constexpr std::uint64_t kThousandMillion = 1'000'000'000;

struct LargeBakeRoom {
  LargeBakeRoom() { level.emitters[0].name = "source"; }

  Level level = testing::shoebox({6, 8, 3}, testing::uniform_material(0.2f), {1, 1, 1});
  Scene scene{level.mesh};
  TraceSettings settings;
  PhotonTracer tracer{scene, level, settings};
};

TEST(BatchTracing, SharesAThousandMillionPhotonsOutAmongShardsWithoutLosingOne) {
  const LargeBakeRoom room;
  BakePlan plan;
  plan.photons = {kThousandMillion + 7};
  plan.sources = 1000;
  const BakeOptions options;
  JournalSet journals({}, false, room.level, room.tracer, 0);
  std::uint64_t all = 0;
  for (const std::uint32_t shard : {0u, 1u, 2u}) {
    const BatchTracing tracing(room.tracer, room.level, plan, options, journals, {shard, 3});
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
