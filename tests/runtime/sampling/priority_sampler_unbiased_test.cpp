// priority_sampler_unbiased_test.cpp: priority sampling is unbiased not only in total, but in every
// band, from every direction and at every delay.
#include <array>
#include <cmath>

#include <gtest/gtest.h>

#include "common/random.h"
#include "runtime/engine/auralizer_input.h"
#include "runtime/sampling/sampler.h"
#include "tests/baked_room.h"

namespace clamor {
namespace {

constexpr std::size_t kChosen = 100, kOctants = 8, kDelays = 10;
constexpr int kRolls = 2000;
constexpr double kDelayBin_s = 0.01;
const Vec3 kListener(4, 5, 1.6);

struct Statistics {
  double whole = 0, sum = 0, squares = 0;
  void add(double estimate) {
    sum += estimate;
    squares += estimate * estimate;
  }
  // Deviation of the mean from the true value, in standard errors.
  double off() const {
    const double mean = sum / kRolls, variance = squares / kRolls - mean * mean;
    return (mean - whole) / std::sqrt(std::max(variance, 1e-30) / kRolls);
  }
};

// Sums of power by band, by octant, by delay, and by all three; the last delay bin holds all later
// delays.
template <class Value>
struct PowerSums {
  std::vector<Value> bands = std::vector<Value>(kBandCount);
  std::vector<Value> octants = std::vector<Value>(kOctants);
  std::vector<Value> delays = std::vector<Value>(kDelays);
  std::vector<Value> cells = std::vector<Value>(kBandCount * kOctants * kDelays);

  std::array<std::vector<Value>*, 4> all() { return {&bands, &octants, &delays, &cells}; }
};

struct PlacedSource {
  Bands intensity;
  std::size_t octant, delay;

  // Calls add(sum, power) for each sum and band.
  template <class Value, class Add>
  void add_to(PowerSums<Value>& sums, double scale, Add add) const {
    for (std::size_t b = 0; b < kBandCount; ++b) {
      const double power = scale * static_cast<double>(intensity[b]);
      add(sums.bands[b], power);
      add(sums.octants[octant], power);
      add(sums.delays[delay], power);
      add(sums.cells[(b * kOctants + octant) * kDelays + delay], power);
    }
  }
};

std::vector<PlacedSource> placed_sources(const AuralizerInput& input,
                                         const RadiationModel& radiation) {
  std::vector<PlacedSource> sources;
  for (const Source& source : input.sources) {
    const Vec3 from = Vec3(source.position_m) - kListener;
    const double delay_s =
        radiation.delay_s(source, kListener) - input.emitters[source.emitter].delay_s;
    sources.push_back({radiation.intensity(source, kListener),
                       (from.x > 0 ? 1u : 0u) + (from.y > 0 ? 2u : 0u) + (from.z > 0 ? 4u : 0u),
                       std::min(static_cast<std::size_t>(delay_s / kDelayBin_s), kDelays - 1)});
  }
  return sources;
}

void expect_unbiased_sums(PowerSums<Statistics>& sums) {
  // There are 26 sums. With other random numbers one of them would exceed 3 standard errors in one
  // of 14 runs.
  for (const auto* of : {&sums.bands, &sums.octants, &sums.delays})
    for (std::size_t i = 0; i < of->size(); ++i) EXPECT_LT(std::abs((*of)[i].off()), 3) << i;

  // There are 640 sums of one band, octant and delay, of which 1.7 are expected beyond 3 standard
  // errors. The eight bands of an octant and delay are correlated, so chance produces eight at
  // once.
  int beyond = 0, audible = 0;
  for (const Statistics& cell : sums.cells) {
    if (cell.whole == 0) continue;
    ++audible;
    beyond += std::abs(cell.off()) > 3;
  }
  EXPECT_GT(audible, 300);
  EXPECT_LE(beyond, 8);
}

void expect_unbiased_sampling(const LateBoost& late_boost, std::size_t voices,
                              std::uint64_t rolls) {
  AuralizerInput input = testing::baked_room(60);
  const RadiationModel radiation(input.emitters, input.materials, input.air, late_boost);
  SignalWeights weights;
  weights.by_signal.assign(input.signals.size(), {1, 2, 3, 4, 5, 4, 3, 2});
  const std::vector<PlacedSource> sources = placed_sources(input, radiation);
  PowerSums<Statistics> sums;
  for (const PlacedSource& source : sources)
    source.add_to(sums, 1, [](Statistics& of, double power) { of.whole += power; });

  for (std::uint32_t roll = 0; roll < kRolls; ++roll) {
    for (std::uint32_t i = 0; i < input.sources.size(); ++i)
      input.sources[i].u = static_cast<float>(unit_above_zero(philox(rolls, {i, roll, 0, 0})[0]));
    SourceList list(radiation, weights, input.sources);
    const auto sampler = make_priority_sampler(radiation, weights, list, voices);
    PowerSums<double> estimates;
    for (const SampledSource& chosen : sampler->sample(kListener))
      sources[chosen.number].add_to(estimates, chosen.power_scale,
                                    [](double& of, double power) { of += power; });
    for (std::size_t g = 0; g < 4; ++g)
      for (std::size_t i = 0; i < sums.all()[g]->size(); ++i)
        (*sums.all()[g])[i].add((*estimates.all()[g])[i]);
  }
  expect_unbiased_sums(sums);
}

TEST(PrioritySampling, IsUnbiasedInEachBandOctantAndDelay) {
  expect_unbiased_sampling({}, kChosen, 21);
}

TEST(PrioritySampling, IsUnbiasedWithBoostedLateSources) {
  expect_unbiased_sampling(LateBoost(0.15), kChosen, 22);
}

}  // namespace
}  // namespace clamor
