#include "runtime/sampler.h"

#include <algorithm>
#include <cmath>
#include <map>

#include <gtest/gtest.h>

#include "common/random.h"
#include "tests/rooms_runtime.h"
#include "tests/runtime/priority_estimates.h"
#include "tests/sanitized.h"

namespace clamor {
namespace {

constexpr std::size_t kVoices = 200;

struct Room {
  explicit Room(const LateBoost& late_boost = {})
      : input(testing::baked_room(400)),
        field(input.emitters, input.materials, input.air, late_boost) {
    weights.by_signal.assign(input.signals.size(), {1, 2, 3, 4, 5, 4, 3, 2});
  }
  const std::vector<Source>& sources() const { return input.sources; }
  SourceList list() const { return {field, weights, input.sources}; }
  double weight_of(std::size_t source, const Vec3& place) const {
    return weight(field, weights.by_signal[field.signal(input.sources[source])],
                  input.sources[source], place);
  }

  AuralizerInput input;
  SourceField field;
  SignalWeights weights;
};

// The definition, written down: all priorities, sorted.
std::map<std::uint64_t, double> slow_sample(const Room& room, const Vec3& place,
                                            std::size_t voices) {
  struct Entry {
    double priority, weight;
    std::uint32_t source;
  };
  std::vector<Entry> all;
  for (std::uint32_t i = 0; i < room.sources().size(); ++i) {
    const float late = room.field.late_boost().at(room.sources()[i].delay_s);
    const double w = room.weight_of(i, place) * (1 + LateBoost::strength(voices) * late);
    if (w > 0) all.push_back({w / room.sources()[i].u, w, i});
  }
  std::sort(all.begin(), all.end(), [](const Entry& a, const Entry& b) {
    return a.priority != b.priority ? a.priority > b.priority : a.source < b.source;
  });
  const double tau = all.size() > voices ? all[voices].priority : 0;
  std::map<std::uint64_t, double> sample;
  for (std::size_t i = 0; i < std::min(voices, all.size()); ++i)
    sample[all[i].source] = std::max(1.0, tau / all[i].weight);
  return sample;
}

Vec3 place(std::uint32_t i) {
  const RandomBits bits = philox(8, {i, 0, 0, 0});
  return {6 * unit(bits[0]), 8 * unit(bits[1]), 3 * unit(bits[2])};
}

void expect_sorted_choice(const Room& room, std::size_t most_voices) {
  SourceList list = room.list();
  const auto sampler = make_priority_sampler(room.field, room.weights, list, most_voices);
  // A walk in small steps, where the last threshold predicts the next, and jumps, where it
  // misleads.
  for (std::uint32_t step = 0; step < 120; ++step) {
    const std::size_t voices = step < 90 ? most_voices : most_voices / 2;
    sampler->choose_at_most(voices);
    const Vec3 listener = step < 60 ? Vec3(1 + 0.05 * step, 2 + 0.03 * step, 1.5) : place(step);
    std::map<std::uint64_t, double> sample;
    for (const SampledSource& chosen : sampler->sample(listener))
      sample[chosen.number] = chosen.power_scale;
    const auto slow = slow_sample(room, listener, voices);
    ASSERT_EQ(sample.size(), slow.size()) << "step " << step;
    auto expected = slow.begin();
    for (const auto& [source, scale] : sample) {
      ASSERT_EQ(source, expected->first) << "step " << step;
      ASSERT_NEAR(scale / expected->second, 1, 1e-12);
      ++expected;
    }
  }
}

TEST(PrioritySampler, ChoosesWhatASortOfAllPrioritiesChooses) {
  expect_sorted_choice(Room(), kVoices);
}

TEST(PrioritySampler, ChoosesWhatASortDoesWhereLateSourcesAreLikelierToo) {
  for (const double t60_s : {0.15, 0.6}) expect_sorted_choice(Room(LateBoost(t60_s)), 10 * kVoices);
}

TEST(PrioritySampler, IsUnbiasedInPowerOverItsPermanentNumbers) {
  Room room;
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
    const auto sampler = make_priority_sampler(room.field, room.weights, list, kVoices);
    for (const SampledSource& chosen : sampler->sample(listener))
      estimate += chosen.power_scale * room.weight_of(chosen.number, listener);
    estimates.add(estimate / whole);
  }
  estimates.expect_unbiased(kVoices);
}

TEST(PrioritySampler, TakesEverythingWhenThereIsRoom) {
  const Room room;
  SourceList list = room.list();
  const auto sampler = make_priority_sampler(room.field, room.weights, list, 100000);
  std::size_t audible = 0;
  for (std::uint32_t i = 0; i < room.sources().size(); ++i)
    audible += room.weight_of(i, {3, 4, 1.5}) > 0;
  const auto sample = sampler->sample({3, 4, 1.5});
  EXPECT_EQ(sample.size(), audible);
  for (const SampledSource& chosen : sample) EXPECT_EQ(chosen.power_scale, 1);
}

TEST(AllSampler, TakesEverySourceAsItIs) {
  const Room room;
  const SourceList list = room.list();
  const auto sampler = make_all_sampler(room.field, list);
  const auto sample = sampler->sample({3, 4, 1.5});
  EXPECT_EQ(sample.size(), room.sources().size());
  for (const SampledSource& chosen : sample) EXPECT_EQ(chosen.power_scale, 1);
}

}  // namespace
}  // namespace clamor
