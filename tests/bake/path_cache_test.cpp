#include "bake/path_cache.h"

#include <array>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "bake/bake.h"
#include "bake/journal/journal_set.h"
#include "bake/journal/run_key.h"
#include "bake/trace/pilot.h"
#include "formats/bake_file/bake_contents.h"
#include "tests/bake/energies.h"
#include "tests/rooms.h"

namespace clamor {
namespace {

using testing::add;
using testing::Energies;
using testing::open_room;
using testing::with_absorption;

constexpr BakeSettings kSettings{.photons = 16384, .longest_path_s = 0.3};

// Settings by which no photon ends early and every reflection leaves a deposit: paths are then the
// same whatever is absorbed.
TraceSettings without_chance() {
  TraceSettings settings;
  settings.roulette_exponent = 0;
  settings.longest_path_s = kSettings.longest_path_s;
  settings.air_loss_per_m = same_in_all_bands(0.002f);
  return settings;
}

struct Traced {
  std::vector<TracedRuns> batches;
  PathCache cache;
};

// Traces photons without a plan's pilot.
Traced trace(const Level& level, const TraceSettings& settings, PathCache cache) {
  Traced traced{{}, std::move(cache)};
  const Scene scene(level.mesh);
  const PhotonTracer tracer(scene, level, settings);
  const RunKeys keys(level, tracer, scene_hash(level, settings));
  BakePlan plan;
  plan.photons = {kSettings.photons};
  traced.cache.begin(level, kSettings, plan, settings, keys.scene());
  for (const auto& batch : plan.batches()) {
    TracedRuns& runs = traced.batches.emplace_back();
    runs.record_paths();
    tracer.trace(batch, runs);
    traced.cache.add(keys.of_all(runs), runs);
  }
  return traced;
}

Traced trace(const Level& level, const TraceSettings& settings = without_chance()) {
  return trace(level, settings, PathCache());
}

void expect_same(std::span<const TracedRuns> is, std::span<const TracedRuns> expected,
                 double tolerance) {
  ASSERT_EQ(is.size(), expected.size());
  for (std::size_t i = 0; i < is.size(); ++i) {
    const auto deposits = is[i].deposits(), others = expected[i].deposits();
    ASSERT_EQ(deposits.size(), others.size());
    ASSERT_GT(deposits.size(), 1000u);
    for (std::size_t d = 0; d < deposits.size(); ++d) {
      ASSERT_EQ(deposits[d].position_m, others[d].position_m);
      ASSERT_EQ(deposits[d].delay_s, others[d].delay_s);
      ASSERT_EQ(deposits[d].random, others[d].random);
      for (std::size_t b = 0; b < kBandCount; ++b)
        ASSERT_NEAR(deposits[d].power[b], others[d].power[b], tolerance * others[d].power[b]);
    }
    for (std::size_t r = 0; r < is[i].runs().size(); ++r) {
      const TraceTally &tally = is[i].runs()[r].tally, &other = expected[i].runs()[r].tally;
      EXPECT_EQ(tally.bounces, other.bounces);
      EXPECT_EQ(tally.escaped, other.escaped);
      for (std::size_t b = 0; b < kBandCount; ++b) {
        EXPECT_GT(other.power_escaped[b], 0);
        EXPECT_GT(other.power_unfinished[b], 0);
        EXPECT_NEAR(tally.power_escaped[b] / other.power_escaped[b], 1, 2 * tolerance);
        EXPECT_NEAR(tally.power_unfinished[b] / other.power_unfinished[b], 1, 2 * tolerance);
      }
      const auto &arrived = is[i].runs()[r].arrived,
                 &others_arrived = expected[i].runs()[r].arrived;
      ASSERT_EQ(arrived.size(), others_arrived.size());
      for (std::size_t m = 0; m < arrived.size(); ++m)
        for (std::size_t b = 0; b < kBandCount; ++b)
          EXPECT_NEAR(arrived[m].power[b] / others_arrived[m].power[b], 1, 4 * tolerance);
    }
  }
}

// Forty reflections multiply forty factors, each rounded to 6e-8.
constexpr double kRounding = 1e-5;

TEST(PathCache, GivesThePhotonsBackIfNothingHasChanged) {
  const Traced traced = trace(open_room());
  const auto same = traced.cache.reweigh(open_room(), kSettings);
  ASSERT_TRUE(same.ok()) << same.error().message;
  expect_same(same->runs(), traced.batches, 1e-7);
}

TEST(PathCache, ReweighsToThePowersOfAFreshTrace) {
  for (const float absorption : {0.1f, 0.5f}) {
    const Traced traced = trace(with_absorption(open_room(), 0, absorption));
    const Level edited = with_absorption(open_room(), 0, 0.6f - absorption);
    const auto reweighed = traced.cache.reweigh(edited, kSettings);
    ASSERT_TRUE(reweighed.ok()) << reweighed.error().message;
    expect_same(reweighed->runs(), trace(edited).batches, kRounding);
  }
}

TEST(PathCache, ReweighsTwoMaterialsThatAreEditedInTurn_NoAsan) {
  const Traced traced = trace(open_room());
  Level edited = with_absorption(open_room(), 0, 0.3f);
  ASSERT_TRUE(traced.cache.reweigh(edited, kSettings).ok());
  edited.materials[1].absorption = {0.6f, 0.5f, 0.4f, 0.3f, 0.2f, 0.1f, 0.3f, 0.5f};
  const auto reweighed = traced.cache.reweigh(edited, kSettings);
  ASSERT_TRUE(reweighed.ok()) << reweighed.error().message;
  expect_same(reweighed->runs(), trace(edited).batches, kRounding);
  const auto back = traced.cache.reweigh(open_room(), kSettings);
  ASSERT_TRUE(back.ok());
  expect_same(back->runs(), traced.batches, 1e-7);
}

TEST(PathCache, RemovesDepositsThatNothingReflectsAnyMore) {
  const Traced traced = trace(open_room());
  const auto reweighed = traced.cache.reweigh(with_absorption(open_room(), 1, 1), kSettings);
  ASSERT_TRUE(reweighed.ok()) << reweighed.error().message;
  const auto fresh = trace(with_absorption(open_room(), 1, 1)).batches;
  for (std::size_t i = 0; i < fresh.size(); ++i) {
    EXPECT_GT(fresh[i].deposits().size(), 0u);
    EXPECT_EQ(reweighed->runs()[i].deposits().size(), fresh[i].deposits().size());
  }
}

std::string refusal(const Traced& traced, const Level& level,
                    const BakeSettings& settings = kSettings) {
  const auto reweighed = traced.cache.reweigh(level, settings);
  return reweighed.ok() ? "" : reweighed.error().message;
}

TEST(PathCache, RefusesWhateverChangesDirections) {
  const Traced traced = trace(open_room());
  const auto edited = [](auto change) {
    Level level = open_room();
    change(level);
    return level;
  };
  const std::string changed = "more than absorption has changed";
  EXPECT_EQ(refusal(traced, open_room()), "");
  EXPECT_EQ(refusal(traced, edited([](Level& level) { level.materials[1].scattering[3] = 0.7f; })),
            changed);
  EXPECT_EQ(refusal(traced, edited([](Level& level) { level.materials[0].phong[0] = 10; })),
            changed);
  EXPECT_EQ(refusal(traced, edited([](Level& level) { level.emitters[0].position_m.x += 0.1; })),
            changed);
  EXPECT_EQ(refusal(traced, edited([](Level& level) { level.mesh.vertices_m[0].x -= 0.1f; })),
            changed);
  EXPECT_EQ(refusal(traced, edited([](Level& level) { level.mesh.materials[4] = 1; })), changed);
  EXPECT_EQ(
      refusal(traced, edited([](Level& level) { level.materials[1].transmission[0] = 0.1f; })),
      changed);
  BakeSettings other = kSettings;
  other.seed = 2;
  EXPECT_EQ(refusal(traced, open_room(), other), changed);
}

TEST(PathCache, RefusesWhatOldPathsCannotTell) {
  const Level deaf = with_absorption(open_room(), 1, 1);
  EXPECT_EQ(refusal(trace(deaf), with_absorption(open_room(), 1, 0.9f)),
            "'soft' has reflected nothing so far");
  Level thin = open_room();
  thin.materials[1].transmission = same_in_all_bands(0.05f);
  EXPECT_EQ(refusal(trace(thin), with_absorption(thin, 1, 0.2f)), "'soft' lets sound through");
  EXPECT_EQ(refusal(trace(thin), with_absorption(thin, 0, 0.2f)), "") << "the other one does not";
  thin.materials[1].transmission = same_in_all_bands(6e-4f);
  EXPECT_EQ(refusal(trace(thin), with_absorption(thin, 1, 0.2f)), "") << "a massive wall";
}

TEST(PathCache, ForgetsPathsBeyondItsMemory) {
  const Traced whole = trace(open_room());
  const std::uint64_t bytes = whole.cache.bytes();
  EXPECT_GT(bytes, 100'000u);
  const Traced half = trace(open_room(), without_chance(), PathCache(bytes / 2));
  EXPECT_EQ(half.cache.bytes(), 0u);
  EXPECT_EQ(refusal(half, open_room()), "no complete bake has kept its paths");
}

// Three emitters whose runs share batches.
Level with_three_emitters() {
  Level level = open_room();
  level.emitters.resize(3, level.emitters[0]);
  level.emitters[1].name = "second";
  level.emitters[1].position_m = {3, 2, 2};
  level.emitters[2].name = "third";
  level.emitters[2].gain = 0.5;
  return level;
}

// A bake of three emitters that keeps its paths.
class BakeOfThree {
 public:
  BakeOfThree(const Level& level, PathCache& cache)
      : level_(level), source_(cache, journals_, keys_) {
    for (const Emitter& emitter : level.emitters)
      plan_.photons.push_back(emitter.name == "second"  ? 700
                              : emitter.name == "third" ? 300
                                                        : 1500);
    cache.begin(level, kSettings, plan_, settings_, keys_.scene());
  }

  // Traces what the cache does not have, batch by batch. Returns the number of traced photons.
  std::uint64_t trace(std::size_t batches = 100) {
    std::uint64_t traced = 0;
    for (const auto& batch : plan_.batches()) {
      if (batches-- == 0) break;
      TracedRuns found, runs;
      std::vector<PhotonRun> missing;
      for (const PhotonRun& run : batch)
        if (!*source_.find(run, found)) missing.push_back(run);
      EXPECT_TRUE(source_.records_paths());
      runs.record_paths();
      tracer_.trace(missing, runs);
      EXPECT_TRUE(source_.record(runs).ok());
      for (const PhotonRun& run : missing) traced += run.count;
      expect_fresh(found);
    }
    return traced;
  }

 private:
  // Runs that were found are those that would have been traced.
  void expect_fresh(const TracedRuns& found) const {
    for (const TracedRun& run : found.runs()) {
      TracedRuns fresh;
      tracer_.trace({&run.run, 1}, fresh);
      const auto is = found.deposits_of(run), expected = fresh.deposits();
      ASSERT_EQ(is.size(), expected.size());
      EXPECT_EQ(std::memcmp(is.data(), expected.data(), is.size_bytes()), 0);
      EXPECT_EQ(run.tally.bounces, fresh.runs()[0].tally.bounces);
    }
  }

  const Level& level_;
  TraceSettings settings_ = without_chance();
  Scene scene_{level_.mesh};
  PhotonTracer tracer_{scene_, level_, settings_};
  RunKeys keys_{level_, tracer_, scene_hash(level_, settings_)};
  OpenJournals none_;
  JournalSet journals_{none_, keys_};
  BakePlan plan_;
  KeptPaths source_;
};

// Each run is re-weighed as if it had been traced alone.
TEST(PathCache, TellsThePathsOfRunsApartThatAreTracedTogether) {
  PathCache cache;
  const Level level = with_three_emitters();
  EXPECT_EQ(BakeOfThree(level, cache).trace(), 2500u);
  const Level edited = with_absorption(level, 0, 0.4f);
  const auto reweighed = cache.reweigh(edited, kSettings);
  ASSERT_TRUE(reweighed.ok()) << reweighed.error().message;
  std::vector<TracedRuns> fresh;
  const Scene scene(edited.mesh);
  const PhotonTracer tracer(scene, edited, without_chance());
  for (const PhotonRun run :
       {PhotonRun{0, 0, 1024}, PhotonRun{0, 1024, 476}, PhotonRun{1, 0, 700}, PhotonRun{2, 0, 300}})
    tracer.trace({&run, 1}, fresh.emplace_back());
  expect_same(reweighed->runs(), fresh, kRounding);
}

TEST(PathCache, TracesOnlyTheEmitterThatHasMovedAndReweighsAll) {
  PathCache cache, fresh;
  Level level = with_three_emitters();
  EXPECT_EQ(BakeOfThree(level, cache).trace(), 2500u);
  const std::uint64_t bytes = cache.bytes();
  level.emitters[1].position_m.x += 0.3;
  EXPECT_EQ(BakeOfThree(level, cache).trace(), 700u);
  EXPECT_EQ(BakeOfThree(level, fresh).trace(), 2500u);
  EXPECT_EQ(cache.bytes(), fresh.bytes()) << "of the emitter's old place nothing is left";
  EXPECT_NEAR(static_cast<double>(bytes), static_cast<double>(fresh.bytes()), 0.1 * bytes);

  const Level edited = with_absorption(level, 0, 0.4f);
  const auto one = cache.reweigh(edited, kSettings), two = fresh.reweigh(edited, kSettings);
  ASSERT_TRUE(one.ok() && two.ok());
  expect_same(one->runs(), two->runs(), 0);
}

TEST(PathCache, FindsThePhotonsOfEmittersThatAreNumberedAnew) {
  PathCache cache;
  Level level = with_three_emitters();
  EXPECT_EQ(BakeOfThree(level, cache).trace(), 2500u);
  std::swap(level.emitters[0], level.emitters[2]);
  EXPECT_EQ(BakeOfThree(level, cache).trace(), 0u);
  level.emitters.pop_back();
  EXPECT_EQ(BakeOfThree(level, cache).trace(), 0u);
  EXPECT_TRUE(cache.reweigh(level, kSettings).ok());
}

TEST(PathCache, ContinuesABakeThatWasStopped) {
  PathCache cache;
  const Level level = with_three_emitters();
  EXPECT_EQ(BakeOfThree(level, cache).trace(1), 1024u);
  EXPECT_FALSE(cache.reweigh(level, kSettings).ok());
  EXPECT_EQ(BakeOfThree(level, cache).trace(1), 0u);
  EXPECT_EQ(BakeOfThree(level, cache).trace(), 1476u);
  EXPECT_TRUE(cache.reweigh(level, kSettings).ok());
}

TEST(PathCache, FindsNothingWhenAMaterialHasChanged) {
  PathCache cache;
  const Level level = with_three_emitters(), softer = with_absorption(level, 0, 0.4f);
  EXPECT_EQ(BakeOfThree(level, cache).trace(), 2500u);
  EXPECT_EQ(BakeOfThree(softer, cache).trace(), 2500u);
}

Energies energies_of(std::span<const TracedRuns> batches) {
  Energies energies{};
  for (const TracedRuns& batch : batches)
    for (const Deposit& deposit : batch.deposits())
      add(energies, deposit.delay_s, deposit.power, 1.0 / kSettings.photons);
  return energies;
}

// Mean and squared standard error over seeds.
struct Estimate {
  Energies sum{}, squares{};
  int count = 0;
  void add(const Energies& energies) {
    ++count;
    for (std::size_t s = 0; s < energies.size(); ++s)
      for (std::size_t b = 0; b < kBandCount; ++b) {
        sum[s][b] += energies[s][b];
        squares[s][b] += energies[s][b] * energies[s][b];
      }
  }
  double mean(std::size_t s, std::size_t b) const { return sum[s][b] / count; }
  double error2(std::size_t s, std::size_t b) const {
    return (squares[s][b] / count - mean(s, b) * mean(s, b)) / (count - 1);
  }
};

// Roulette, splitting and thinning, as a bake of this level has them.
TraceSettings with_chance(const Level& level, std::uint64_t seed) {
  TraceSettings settings = without_chance();
  settings.seed = seed;
  settings.roulette_exponent = 0.5;
  const Pilot pilot = trace_pilot(Scene(level.mesh), level, settings);
  settings.decay = pilot.decay;
  settings.deposit_threshold = pilot.threshold(kSettings.photons, 3.0 * kSettings.photons);
  return settings;
}

// Roulette, splitting and thinning acted at the old absorption. They must not change the mean over
// seeds.
TEST(PathCache, IsUnbiasedAgainstAFreshTrace_NoAsan) {
  for (const auto& [from, to] : {std::pair(0.1f, 0.5f), std::pair(0.3f, 0.2f)}) {
    const Level before = with_absorption(open_room(), 0, from);
    Level after = with_absorption(open_room(), 0, to);
    after.materials[0].absorption[6] = 0.25f;
    Estimate fresh, reweighed;
    for (std::uint64_t seed = 1; seed <= 12; ++seed) {
      const TraceSettings settings = with_chance(before, seed);
      EXPECT_GT(settings.deposit_threshold, 0);
      const Traced traced = trace(before, settings, PathCache(PathCache::kMaxBytes, 0));
      const auto one = traced.cache.reweigh(after, kSettings);
      ASSERT_TRUE(one.ok()) << one.error().message;
      reweighed.add(energies_of(one->runs()));
      fresh.add(energies_of(trace(after, with_chance(after, seed + 1000)).batches));
    }
    double chi2 = 0;
    for (std::size_t s = 0; s < 3; ++s)
      for (std::size_t b = 0; b < kBandCount; ++b) {
        const double error = std::sqrt(fresh.error2(s, b) + reweighed.error2(s, b));
        const double difference = reweighed.mean(s, b) - fresh.mean(s, b);
        // A factor that is missing at one reflection changes the energy by 40 % and more.
        EXPECT_LT(error, 0.05 * fresh.mean(s, b)) << "span " << s << ", band " << b;
        EXPECT_LT(std::abs(difference), 4.5 * error) << "span " << s << ", band " << b;
        chi2 += difference * difference / (error * error) / 24;
      }
    EXPECT_LT(chi2, 3);  // 1 but for chance; neighbouring bands are correlated
  }
}

}  // namespace
}  // namespace clamor
