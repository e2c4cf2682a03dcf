#include <algorithm>
#include <cmath>
#include <map>

#include <gtest/gtest.h>

#include "common/random.h"
#include "runtime/sampling/sampler.h"
#include "tests/runtime/priority_estimates.h"
#include "tests/runtime/priority_sample_reference.h"
#include "tests/runtime/weighted_room.h"
#include "tests/sanitized.h"
#include "tools/strategies/all_sampler.h"

namespace clamor {
namespace {

using Room = testing::WeightedRoom;

constexpr std::size_t kSampleVoices = 200;

// `powers` are those of emitters.
std::map<std::uint64_t, double> reference_priority_sample(const Room& room, const Vec3& place,
                                                          std::size_t voices,
                                                          const std::vector<float>& powers = {}) {
  std::vector<testing::WeightedSource> all;
  for (std::uint32_t i = 0; i < room.sources().size(); ++i) {
    const Source& source = room.sources()[i];
    const float late = room.radiation.late_boost().at(source.delay_s);
    const double power = source.emitter < powers.size() ? powers[source.emitter] : 1;
    all.push_back(
        {i, power * room.weight_of(i, place) * (1 + LateBoost::strength(voices) * late), source.u});
  }
  return testing::reference_sample(std::move(all), voices);
}

Vec3 place(std::uint32_t i) {
  const RandomBits bits = philox(8, {i, 0, 0, 0});
  return {6 * unit(bits[0]), 8 * unit(bits[1]), 3 * unit(bits[2])};
}

void expect_sorted_choice(const Room& room, std::size_t max_voices) {
  SourceList list = room.list();
  const auto sampler = make_priority_sampler(room.radiation, room.weights, list, max_voices);
  // In small steps the last threshold predicts the next; jumps mislead the predictor.
  for (std::uint32_t step = 0; step < 120; ++step) {
    const std::size_t voices = step < 90 ? max_voices : max_voices / 2;
    sampler->set_voice_count(voices);
    const Vec3 listener = step < 60 ? Vec3(1 + 0.05 * step, 2 + 0.03 * step, 1.5) : place(step);
    testing::expect_sample(sampler->sample(listener),
                           reference_priority_sample(room, listener, voices), 1e-12);
    if (::testing::Test::HasFatalFailure()) FAIL() << "step " << step;
  }
}

TEST(PrioritySampler, GivesTheSampleOfASortOfAllPriorities) {
  expect_sorted_choice(Room(400), kSampleVoices);
}

TEST(PrioritySampler, GivesTheSampleOfASortWithBoostedLateSources_NoAsan) {
  for (const double t60_s : {0.15, 0.6})
    expect_sorted_choice(Room(400, LateBoost(t60_s)), 10 * kSampleVoices);
}

TEST(PrioritySampler, GivesTheSampleOfASortWithEmittersThatAreTurnedDown) {
  const Room room(400);
  SourceList list = room.list();
  const auto sampler = make_priority_sampler(room.radiation, room.weights, list, kSampleVoices);
  const Vec3 listener(3, 4, 1.5);
  for (const std::vector<float>& powers :
       {std::vector<float>{}, {0.25f}, {1, 0}, {0.01f, 0.5f, 0}, {0, 0, 0}, {1, 1, 1}}) {
    sampler->set_emitter_powers(powers);
    const auto sample = sampler->sample(listener);
    testing::expect_sample(sample, reference_priority_sample(room, listener, kSampleVoices, powers),
                           1e-6);
    for (const SampledSource& chosen : sample) {
      const std::uint32_t emitter = chosen.source->emitter;
      EXPECT_EQ(power_gain(chosen.factors),
                same_in_all_bands(emitter < powers.size() ? powers[emitter] : 1));
    }
  }
}

TEST(PrioritySampler, IsUnbiasedInTotalPower_NoAsan) {
  Room room(400);
  const Vec3 listener(4, 5, 1.6);
  double whole = 0;
  for (std::uint32_t i = 0; i < room.sources().size(); ++i) whole += room.weight_of(i, listener);
  testing::PriorityEstimates estimates;
  constexpr int kRolls = testing::kSanitized ? 100 : 500;
  for (std::uint32_t roll = 0; roll < kRolls; ++roll) {
    for (std::uint32_t i = 0; i < room.sources().size(); ++i)
      room.input.sources[i].u = static_cast<float>(unit_above_zero(philox(9, {i, roll, 0, 0})[0]));
    double estimate = 0;
    SourceList list = room.list();
    const auto sampler = make_priority_sampler(room.radiation, room.weights, list, kSampleVoices);
    for (const SampledSource& chosen : sampler->sample(listener))
      estimate += chosen.power_scale * room.weight_of(chosen.number, listener);
    estimates.add(estimate / whole);
  }
  estimates.expect_unbiased(kSampleVoices);
}

TEST(PrioritySampler, TakesEverythingWhenThereIsRoom) {
  const Room room(400);
  SourceList list = room.list();
  const auto sampler = make_priority_sampler(room.radiation, room.weights, list, 100000);
  std::size_t audible = 0;
  for (std::uint32_t i = 0; i < room.sources().size(); ++i)
    audible += room.weight_of(i, {3, 4, 1.5}) > 0;
  const auto sample = sampler->sample(Vec3(3, 4, 1.5));
  EXPECT_EQ(sample.size(), audible);
  for (const SampledSource& chosen : sample) EXPECT_EQ(chosen.power_scale, 1);
}

// A load control may ask for more sources than those that are about as loud as each other.
TEST(PrioritySampler, LeapsToSourcesThatAreFarQuieterThanTheRest) {
  Room room(400);
  const std::size_t count = room.sources().size();
  for (std::size_t i = 0; i < count; i += 2)
    for (float& power : room.input.sources[i].power) power *= 1e-9f;
  SourceList list = room.list();
  const auto sampler = make_priority_sampler(room.radiation, room.weights, list, count, nullptr,
                                             SearchBound::kBounded);
  const auto work_of = [&](std::size_t voices) {
    const std::uint64_t before = sampler->work();
    sampler->set_voice_count(voices);
    EXPECT_EQ(sampler->sample(Vec3(3, 4, 1.5)).size(), voices);
    return sampler->work() - before;
  };
  std::size_t audible = 0;
  for (std::uint32_t i = 1; i < count; i += 2) audible += room.weight_of(i, {3, 4, 1.5}) > 0;
  const std::uint64_t of_one_query = work_of(audible / 2);
  for (int keyframe = 0; keyframe < 5; ++keyframe) work_of(audible - 10);
  EXPECT_LT(work_of(audible + 10), 20 * of_one_query);
  EXPECT_EQ(sampler->bounded_keyframes(), 0u);
}

TEST(AllSampler, TakesEverySourceUnscaled) {
  const Room room(400);
  const SourceList list = room.list();
  const auto sampler = make_all_sampler(room.radiation, list);
  const auto sample = sampler->sample(Vec3(3, 4, 1.5));
  EXPECT_EQ(sample.size(), room.sources().size());
  for (const SampledSource& chosen : sample) EXPECT_EQ(chosen.power_scale, 1);
}

}  // namespace
}  // namespace clamor
