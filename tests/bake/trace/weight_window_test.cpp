// What the estimated decay decides: which photons are split or end, and which deposits are kept.
#include "bake/trace/weight_window.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <numeric>
#include <set>
#include <string>
#include <tuple>
#include <vector>

#include <gtest/gtest.h>

#include "bake/octree/source_thinning.h"
#include "bake/trace/deposit_weight.h"
#include "bake/trace/photon_tracer.h"
#include "bake/trace/pilot.h"
#include "bake/trace/scene.h"
#include "common/bands.h"
#include "formats/gltf/level_import.h"
#include "tests/build_paths.h"
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

// --- Thinning by the same estimate
// -----------------------------------------------------------------

// The formula of the header, in double precision.
double weight_of(const DecayModel& decay, const Bands& power, double path_m) {
  double weight = 0, share = 0;
  for (std::size_t b = 0; b < kBandCount; ++b) {
    const double before_m = std::min<double>(path_m, decay.knee_m[b]);
    const double lost = before_m / decay.early_m[b] + (path_m - before_m) / decay.late_m[b];
    const double left = std::max(std::exp(-lost), std::exp2(-23));
    weight += power[b] / left;
    share += std::pow(left, 0.6) / kBandCount;
  }
  return weight * share;
}

TEST(DepositWeight, ComparesPowersWithTheDecay) {
  DecayModel decay;
  Bands power{};
  for (std::size_t b = 0; b < kBandCount; ++b) {
    decay.early_m[b] = 20 - 2.0f * static_cast<float>(b);
    decay.knee_m[b] = 2 * decay.early_m[b];
    decay.late_m[b] = 1.5f * decay.early_m[b];
    power[b] = 1e-3f * static_cast<float>(b + 1);
  }
  const DepositWeight weight(decay);
  EXPECT_NEAR(weight.of(power, 0) / sum_of(power), 1, 1e-6);
  for (const float path_m : {1.0f, 12.0f, 35.0f, 120.0f, 400.0f, 20'000.0f})
    EXPECT_NEAR(weight.of(power, path_m) / weight_of(decay, power, path_m), 1, 2e-5) << path_m;
  EXPECT_NEAR(DepositWeight().of(power, 50) / sum_of(power), 1, 1e-6) << "no estimate";
}

// Its high bands decay several times as fast as its low ones.
Level room_of_uneven_bands() {
  Material hard = testing::uniform_material(0.02f);
  for (std::size_t b = 4; b < kBandCount; ++b) hard.absorption[b] = 0.25f;
  return uneven_room(hard);
}

struct Thinned {
  std::vector<Source> all, kept;
};

// The deposits of 4096 photons, and those of them that both steps of thinning keep.
Thinned thinned(const Level& level, std::uint64_t seed, std::size_t sources) {
  const Scene scene(level.mesh);
  TraceSettings settings;
  settings.seed = seed;
  const Pilot pilot = trace_pilot(scene, level, settings);
  settings.decay = pilot.decay;
  constexpr std::uint32_t kRuns = 4;
  constexpr double kPhotons = kRuns * kRunPhotons;
  Thinned result;
  SourceThinning thinning(sources, DepositWeight(pilot.decay), settings.speed_mps);
  for (const bool keeps_all : {true, false}) {
    settings.deposit_threshold =
        keeps_all ? 0 : pilot.threshold(kPhotons, 1.25 * static_cast<double>(sources));
    const PhotonTracer tracer(scene, level, settings);
    for (std::uint32_t run = 0; run < kRuns; ++run) {
      TracedRuns traced;
      const PhotonRun of_photons{0, std::uint64_t{run} * kRunPhotons, kRunPhotons};
      tracer.trace({&of_photons, 1}, traced);
      std::vector<Source> deposits;
      for (const Deposit& deposit : traced.deposits())
        deposits.push_back(secondary_source(deposit, 1 / kPhotons));
      if (keeps_all)
        result.all.insert(result.all.end(), deposits.begin(), deposits.end());
      else
        thinning.add(deposits, tracer.deposit_threshold(0) / kPhotons);
    }
  }
  result.kept = thinning.take().take_vector();
  return result;
}

constexpr std::size_t kParts = 4;  // of the decay, of 10 dB each

std::size_t part_of(const Source& source, float part_s) {
  return static_cast<std::size_t>(source.delay_s / part_s);
}

// Sum of powers and effective number (sum p)^2 / sum p^2 of the sources of each part, in a band.
struct Part {
  double power = 0, squares = 0;
  double number() const { return power * power / squares; }
};
std::vector<Part> parts_of(const std::vector<Source>& sources, std::size_t band, float part_s) {
  std::vector<Part> parts(kParts);
  for (const Source& source : sources) {
    const std::size_t at = part_of(source, part_s);
    if (at >= kParts) continue;
    parts[at].power += static_cast<double>(source.power[band]);
    parts[at].squares += std::pow(static_cast<double>(source.power[band]), 2);
  }
  return parts;
}

// The time in which a band of all deposits decays by 10 dB, if it does so exponentially.
float decay_by_10_db_s(const std::vector<Source>& sources, std::size_t band) {
  double sum = 0, moment = 0;
  for (const Source& source : sources) {
    sum += static_cast<double>(source.power[band]);
    moment += static_cast<double>(source.power[band]) * static_cast<double>(source.delay_s);
  }
  return static_cast<float>(moment / sum * std::log(10.0));
}

TEST(DepositWeight, KeepsThePowerOfEachPartOfTheDecay_NoAsan) {
  constexpr int kSeeds = 12;
  constexpr std::array<std::size_t, 2> kSome = {1, 6};
  std::array<std::array<std::vector<double>, kParts>, 2> off;  // by band and part, of all seeds
  for (int seed = 1; seed <= kSeeds; ++seed) {
    const Thinned one = thinned(room_of_uneven_bands(), static_cast<std::uint64_t>(seed), 10'000);
    for (std::size_t i = 0; i < kSome.size(); ++i) {
      const float part_s = decay_by_10_db_s(one.all, kSome[i]);
      const auto all = parts_of(one.all, kSome[i], part_s);
      const auto kept = parts_of(one.kept, kSome[i], part_s);
      for (std::size_t p = 0; p < kParts; ++p)
        off[i][p].push_back(kept[p].power / all[p].power - 1);
    }
  }
  for (std::size_t i = 0; i < kSome.size(); ++i)
    for (std::size_t p = 0; p < kParts; ++p) {
      const double error = deviation(off[i][p]) / std::sqrt(kSeeds);
      EXPECT_LT(std::abs(mean(off[i][p])), 4.5 * error) << "band " << kSome[i] << ", part " << p;
      EXPECT_LT(error, p == 0 ? 0.005 : 0.06) << "band " << kSome[i] << ", part " << p;
    }
}

// The thinning before this weight: probabilities proportional to the fourth root of the power, in
// two steps that multiplied.
std::vector<Part> by_fourth_root(const std::vector<Source>& all, double wanted, std::size_t band,
                                 float part_s) {
  const auto odds_of = [](double weight, double threshold) {
    return std::min(1.0, std::sqrt(std::sqrt(weight / threshold)));
  };
  const auto threshold_of = [&](double number, const auto& expected) {
    double low = 1e-20, high = 1;
    for (int step = 0; step < 60; ++step) {
      const double middle = std::sqrt(low * high);
      (expected(middle) > number ? low : high) = middle;
    }
    return high;
  };
  const double first = threshold_of(1.37 * wanted, [&](double threshold) {
    double number = 0;
    for (const Source& source : all) number += odds_of(sum_of(source.power), threshold);
    return number;
  });
  const auto odds_of_both = [&](double power, double second) {
    const double odds = odds_of(power, first);
    return odds * odds_of(power / odds, second);
  };
  const double second = threshold_of(wanted, [&](double threshold) {
    double number = 0;
    for (const Source& source : all) number += odds_of_both(sum_of(source.power), threshold);
    return number;
  });
  std::vector<Part> parts(kParts);
  for (const Source& source : all) {
    const std::size_t at = part_of(source, part_s);
    if (at >= kParts) continue;
    const auto power = static_cast<double>(source.power[band]);
    parts[at].power += power;
    parts[at].squares += power * power / odds_of_both(sum_of(source.power), second);
  }
  return parts;
}

TEST(DepositWeight, LeavesLateSoundMoreSourcesThanItsPowerAlone_NoAsan) {
  constexpr int kSeeds = 2;
  constexpr std::size_t kBand = 6, kSources = 40'000;
  const auto violin_room =
      import_level(std::string(testing::kSourceDir) + "/assets/levels/violin_room.glb", {});
  ASSERT_TRUE(violin_room.ok());
  std::vector<double> gain(kParts);
  for (int seed = 1; seed <= kSeeds; ++seed) {
    const Thinned one = thinned(violin_room->level, static_cast<std::uint64_t>(seed), kSources);
    const float part_s = decay_by_10_db_s(one.all, kBand);
    const auto kept = parts_of(one.kept, kBand, part_s);
    const auto before = by_fourth_root(one.all, kSources, kBand, part_s);
    for (std::size_t p = 0; p < kParts; ++p)
      gain[p] += 10 * std::log10(kept[p].number() / before[p].number()) / kSeeds;
  }
  EXPECT_GT(gain[0], -0.5);
  EXPECT_GT(gain[2], 1);
  EXPECT_GT(gain[3], 1);
}

}  // namespace
}  // namespace clamor
