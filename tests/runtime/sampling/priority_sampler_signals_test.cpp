// priority_sampler_signals_test.cpp: priorities follow the levels that signals have at the moment.
#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <numbers>
#include <numeric>
#include <vector>

#include <gtest/gtest.h>

#include "bake/octree/octree_builder.h"
#include "common/random.h"
#include "common/sample_rate.h"
#include "formats/level/signal.h"
#include "runtime/propagation/source_weight.h"
#include "runtime/query/octree_pool.h"
#include "runtime/sampling/sampler.h"
#include "tests/runtime/priority_sample_reference.h"
#include "tests/sanitized.h"
#include "tests/stored_tree.h"

namespace clamor {
namespace {

Signal gated_noise(double seconds, bool loop, std::uint32_t seed) {
  Signal signal{"noise", {}, loop};
  for (std::uint32_t i = 0; i < seconds * kSampleRate_hz; ++i)
    signal.samples.push_back(static_cast<float>(unit(philox(seed, {i, 0, 0, 0})[0]) - 0.5));
  return signal;
}

// The signal with silence outside a range of time.
Signal silent_outside(Signal signal, double from_s, double to_s) {
  for (std::size_t i = 0; i < signal.samples.size(); ++i) {
    const double t = static_cast<double>(i) / kSampleRate_hz;
    if (t < from_s || t >= to_s) signal.samples[i] = 0;
  }
  return signal;
}

SignalWeights weights_of(const std::vector<Signal>& signals) {
  std::vector<TimedEnvelope> envelopes;
  for (const Signal& signal : signals)
    envelopes.push_back({SignalEnvelope(signal), signal.samples.size(), signal.loop});
  return make_signal_weights(envelopes);
}

// Sources in a hall, from emitters that play different signals.
struct WeightedHall {
  WeightedHall(std::vector<Signal> played, std::uint32_t count, std::uint64_t seed)
      : signals(std::move(played)), weights(weights_of(signals)) {
    materials.resize(1);
    materials[0].scattering = same_in_all_bands(0.5f);
    materials[0].phong = same_in_all_bands(8);
    for (std::uint32_t e = 0; e < 2 * signals.size(); ++e) {
      const RandomBits bits = philox(seed, {e, 7, 0, 0});
      Emitter& emitter = emitters.emplace_back();
      emitter.position_m = {20 * unit(bits[0]), 8 * unit(bits[1]), 15 * unit(bits[2])};
      emitter.signal = e % static_cast<std::uint32_t>(signals.size());
      emitter.delay_s = 0.4 * unit(bits[3]);
    }
    for (std::uint32_t i = 0; i < count; ++i) {
      const RandomBits a = philox(seed, {i, 0, 0, 0}), b = philox(seed, {i, 1, 0, 0});
      Source& source = all.emplace_back();
      source.position_m = Vec3f(Vec3(20 * unit(a[0]), 8 * unit(a[1]), 15 * unit(a[2])));
      const double turn = 2 * std::numbers::pi * unit(b[3]);
      source.normal = Vec3f(Vec3(std::cos(turn), 0, std::sin(turn)));
      source.mirror = source.normal;
      source.delay_s = static_cast<float>(1.5 * unit(b[0]));
      source.power = same_in_all_bands(static_cast<float>(std::pow(10, -4 * unit(b[0]))));
      source.u = static_cast<float>(unit_above_zero(b[1]));
      source.emitter = b[2] % static_cast<std::uint32_t>(emitters.size());
    }
  }

  RadiationModel radiation() const { return {emitters, materials, Air{}}; }

  std::vector<Signal> signals;
  SignalWeights weights;
  std::vector<Material> materials;
  std::vector<Emitter> emitters;
  std::vector<Source> all;
};

// Two loops with different rhythms, one of them quiet, and two one-shots.
std::vector<Signal> played() {
  Signal quiet = gated_noise(0.77, true, 2);
  for (float& sample : quiet.samples) sample *= 0.05f;
  return {silent_outside(gated_noise(2, true, 1), 0.5, 0.9), quiet, gated_noise(0.3, false, 3),
          silent_outside(gated_noise(3, false, 4), 2.7, 3)};
}

// Numbers and power scales of the sample.
std::map<std::uint64_t, double> expected_sample(const WeightedHall& hall,
                                                const RadiationModel& radiation,
                                                std::span<const Source> sources, std::size_t voices,
                                                const Vec3& place, double time_s) {
  std::vector<testing::WeightedSource> all;
  for (std::uint64_t i = 0; i < sources.size(); ++i) {
    const Source& source = sources[i];
    const Emitter& emitter = hall.emitters[source.emitter];
    const double heard_s = time_s - emitter.delay_s - source.delay_s -
                           length(place - Vec3(source.position_m)) / speed_of_sound_mps(Air{});
    const auto now = hall.weights.tracks[emitter.signal].at(heard_s);
    const Bands intensity = radiation.intensity(source, place);
    double weight = 0;
    for (std::size_t b = 0; b < kBandCount; ++b)
      weight += static_cast<double>(now.weights[b]) * intensity[b];
    all.push_back({i, weight, source.u});
  }
  return testing::reference_sample(std::move(all), voices);
}

TEST(SignalSampling, GivesTheSampleOfASortOfAllSourcesAtAnyTime) {
  const WeightedHall hall(played(), 6000, 1);
  const RadiationModel radiation = hall.radiation();
  testing::StoredTrees trees;
  trees.add(build_octree(hall.all));
  const std::vector<Source> sources = trees.all_sources();
  for (const std::size_t voices : {1u, 50u, 1000u}) {
    PageLoader loader(trees.fetch(radiation, hall.weights), PageBudget{1'000'000'000});
    OctreePool pool(radiation, hall.weights, trees.tops(), {}, loader);
    const auto sampler = make_priority_sampler(radiation, hall.weights, pool, voices);
    // The listener stands still, walks, and jumps in place and time.
    for (std::uint32_t i = 0; i < 40; ++i) {
      const RandomBits bits = philox(6, {i, 0, 0, 0});
      const double time_s = i < 25 ? 0.5 + 0.02 * i : 8 * unit(bits[0]) - 0.5;
      const Vec3 place = i < 15   ? Vec3(7, 1.7, 6)
                         : i < 25 ? Vec3(7 + 0.05 * i, 1.7, 6)
                                  : Vec3(20 * unit(bits[1]), 1.7, 15 * unit(bits[2]));
      auto sample = sampler->sample(place, time_s);
      while (!sampler->complete()) sample = sampler->sample(place, time_s);
      testing::expect_sample(
          sample, expected_sample(hall, radiation, sources, voices, place, time_s), 1e-9);
      if (HasFatalFailure()) FAIL() << voices << " voices, " << i;
    }
  }
}

// Queries are made ahead for a listener who walks straight on; one who turns, jumps, stands still
// or is late gets the same sample as well.
TEST(SignalSampling, GivesTheSampleOfASortToAListenerWhoWalksAndTurns) {
  const WeightedHall hall(played(), 20'000, 9);
  const RadiationModel radiation = hall.radiation();
  testing::StoredTrees trees;
  trees.add(build_octree(hall.all));
  const std::vector<Source> sources = trees.all_sources();
  PageLoader loader(trees.fetch(radiation, hall.weights), PageBudget{1'000'000'000});
  OctreePool pool(radiation, hall.weights, trees.tops(), {}, loader);
  constexpr std::size_t kVoices = 200;
  const auto sampler = make_priority_sampler(radiation, hall.weights, pool, kVoices);
  Vec3 place(3, 1.7, 3);
  double heading = 0, time_s = 3;
  constexpr std::uint32_t kKeyframes = testing::kSanitized ? 120 : 200;
  for (std::uint32_t k = 0; k < kKeyframes; ++k) {
    const RandomBits bits = philox(8, {k, 0, 0, 0});
    const std::uint32_t in_round = k % 100;
    heading += in_round < 80 ? 0.01 : 2 * unit(bits[0]);
    const Vec3 ahead(std::sin(heading), 0.1 * std::sin(7 * heading), std::cos(heading));
    if (in_round % 40 != 30) place += 0.03 * ahead;
    if (in_round == 90) place = {10 + unit(bits[1]), 1.7, 8};
    time_s += k / 100 % 2 == 1 ? 0.06 : in_round == 50 ? 0.035 : 0.02;
    auto sample = sampler->sample(place, time_s);
    while (!sampler->complete()) sample = sampler->sample(place, time_s);
    testing::expect_sample(sample,
                           expected_sample(hall, radiation, sources, kVoices, place, time_s), 1e-9);
    if (HasFatalFailure()) FAIL() << k;
  }
}

TEST(SignalSampling, GivesNoVoiceToSilentSources) {
  const WeightedHall hall(played(), 2000, 2);
  const RadiationModel radiation = hall.radiation();
  SourceList list(radiation, hall.weights, hall.all);
  const auto sampler = make_priority_sampler(radiation, hall.weights, list, 5000);
  std::vector<int> heard(hall.signals.size());
  for (double time_s = 0; time_s < 12; time_s += 0.1) {
    for (const SampledSource& chosen : sampler->sample(Vec3(5, 1.7, 5), time_s)) {
      const Source& source = *chosen.source;
      ++heard[chosen.signal];
      // A one-shot is silent before it starts and long after its end.
      const double at_s = time_s - radiation.delay_s(source, {5, 1.7, 5});
      if (chosen.signal == 2) {
        EXPECT_TRUE(at_s > -0.15 && at_s < 1) << at_s;
      }
      if (chosen.signal == 3) {
        EXPECT_TRUE(at_s > 2.5 && at_s < 3.7) << at_s;
      }
      if (chosen.signal == 0) {
        const double in_loop_s = std::fmod(at_s + 20, 2);
        EXPECT_TRUE(in_loop_s > 0.3 && in_loop_s < 1.6) << in_loop_s;
      }
    }
  }
  for (const int times : heard) EXPECT_GT(times, 100);
  // The last echoes of one-shots have ended by then; the loops continue.
  for (const SampledSource& chosen : sampler->sample(Vec3(5, 1.7, 5), 1e6))
    EXPECT_LT(chosen.signal, 2u);
}

TEST(SignalSampling, ChoosesNothingAfterAllSoundsHaveEnded) {
  const WeightedHall hall({gated_noise(0.3, false, 1)}, 1000, 3);
  const RadiationModel radiation = hall.radiation();
  testing::StoredTrees trees;
  trees.add(build_octree(hall.all));
  PageLoader loader(trees.fetch(radiation, hall.weights), PageBudget{1'000'000'000});
  OctreePool pool(radiation, hall.weights, trees.tops(), {}, loader);
  const auto sampler = make_priority_sampler(radiation, hall.weights, pool, 100);
  EXPECT_EQ(sampler->sample(Vec3(5, 1.7, 5), 1).size(), 100u);
  EXPECT_TRUE(sampler->sample(Vec3(5, 1.7, 5), 10).empty());
}

// Loads a page and all below it permanently.
void load_all(PageLoader& loader, const PageEntry& entry) {
  ASSERT_TRUE(loader.load_now(entry));
  for (const PageEntry& child : loader.find(entry)->links.children) load_all(loader, child);
}

// Otherwise a loud sound would make every later sample as expensive as its own.
TEST(SignalSampling, CostsNoMoreAfterALoudSound) {
  Signal quiet = gated_noise(1, true, 2);
  for (float& sample : quiet.samples) sample *= 0.01f;
  const WeightedHall hall({quiet, gated_noise(0.3, false, 1)}, 60'000, 4);
  const RadiationModel radiation = hall.radiation();
  testing::StoredTrees trees;
  trees.add(build_octree(hall.all));
  std::array<std::uint64_t, 2> visited{};
  for (std::size_t after_loud = 0; after_loud < 2; ++after_loud) {
    PageLoader loader(trees.fetch(radiation, hall.weights), PageBudget{1'000'000'000});
    // All pages are loaded in advance, because the time of their arrival changes what is queried.
    load_all(loader, trees.tops().back());
    OctreePool pool(radiation, hall.weights, trees.tops(), {}, loader);
    const auto sampler = make_priority_sampler(radiation, hall.weights, pool, 100);
    // A listener who stands still would visit nothing.
    Vec3 place(5, 1.7, 5);
    if (after_loud == 1) sampler->sample(place, 0.5);
    for (int i = 0; i < 300; ++i) {
      const std::uint64_t before = pool.nodes_visited();
      place.x += 0.03;
      sampler->sample(place, 20 + 0.02 * i);
      EXPECT_TRUE(sampler->complete());
      const std::uint64_t now = pool.nodes_visited() - before;
      // The threshold predictor recovers from the fall of the threshold within half a second.
      if (i < 10) continue;
      // With the loud sound in its bounds a query would visit all nodes.
      EXPECT_LT(now, trees.page_count() / 2);
      visited[after_loud] += now;
    }
  }
  // The cached nodes and their bounds depend on earlier thresholds, by about a node per keyframe.
  EXPECT_NEAR(static_cast<double>(visited[1]) / static_cast<double>(visited[0]), 1, 0.15);
}

// Received power with the current level of the source's signal.
double heard_now(const WeightedHall& hall, const RadiationModel& radiation,
                 const SignalWeights& raw, const Source& source, const Vec3& place, double time_s) {
  const auto now =
      weights_at_place(radiation, raw, hall.emitters[source.emitter].signal, source, place, time_s);
  return weight(radiation, now.weights, source, place);
}

// Two loops alternate, so half of the sources are silent at any time.
TEST(SignalSampling, IsUnbiasedAndMorePreciseThanByMeanLevelsWhenHalfIsSilent) {
  std::vector<Signal> turns = {silent_outside(gated_noise(2, true, 1), 0, 0.9),
                               silent_outside(gated_noise(2, true, 2), 1, 1.9)};
  constexpr std::size_t kVoices = 150;
  constexpr int kSeeds = 40;
  WeightedHall hall(turns, 4000, 5);
  const RadiationModel radiation = hall.radiation();
  std::vector<TimedEnvelope> envelopes;
  for (const Signal& signal : turns)
    envelopes.push_back({SignalEnvelope(signal), signal.samples.size(), signal.loop});
  const SignalWeights raw = make_signal_weights(envelopes, {0, 0, 0});
  SignalWeights by_mean = hall.weights;
  by_mean.tracks.clear();

  const Vec3 place(8, 1.7, 7);
  std::array<double, 2> sum{}, squares{};
  int looks = 0, far = 0;
  for (int seed = 0; seed < kSeeds; ++seed) {
    for (std::uint32_t i = 0; i < hall.all.size(); ++i)
      hall.all[i].u = static_cast<float>(
          unit_above_zero(philox(100 + static_cast<std::uint64_t>(seed), {i, 0, 0, 0})[0]));
    SourceList list(radiation, hall.weights, hall.all), mean_list(radiation, by_mean, hall.all);
    const std::array samplers = {make_priority_sampler(radiation, hall.weights, list, kVoices),
                                 make_priority_sampler(radiation, by_mean, mean_list, kVoices)};
    for (double time_s = 10; time_s < 12; time_s += 0.25) {
      double whole = 0;
      for (const Source& source : hall.all)
        whole += heard_now(hall, radiation, raw, source, place, time_s);
      for (std::size_t s = 0; s < samplers.size(); ++s) {
        double heard = 0;
        for (const SampledSource& chosen : samplers[s]->sample(place, time_s))
          heard +=
              chosen.power_scale * heard_now(hall, radiation, raw, *chosen.source, place, time_s);
        sum[s] += heard / whole;
        squares[s] += (heard / whole - 1) * (heard / whole - 1);
        if (s == 0) far += std::abs(10 * std::log10(heard / whole)) > 0.8;
      }
      ++looks;
    }
  }
  // Both are unbiased.
  for (std::size_t s = 0; s < 2; ++s)
    EXPECT_NEAR(sum[s] / looks, 1, 3 * std::sqrt(squares[s] / looks / kSeeds)) << s;
  // The sample is within 0.8 dB in 95 of 100 cases at every moment, not only over ten seconds.
  EXPECT_LE(far, looks / 20);
  EXPECT_LT(squares[0], 0.8 * squares[1]);
  RecordProperty("spread", std::to_string(std::sqrt(squares[0] / looks)));
  RecordProperty("spread_by_mean", std::to_string(std::sqrt(squares[1] / looks)));
}

}  // namespace
}  // namespace clamor
