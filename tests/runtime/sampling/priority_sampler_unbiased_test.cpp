// priority_sampler_unbiased_test.cpp: priority sampling is unbiased not only in total, but in every
// band, from every direction and at every delay.
#include <array>
#include <cmath>

#include <gtest/gtest.h>

#include "common/random.h"
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

void expect_unbiased_sampling(const LateBoost& late_boost, std::size_t voices,
                              std::uint64_t rolls) {
  AuralizerInput input = testing::baked_room(60);
  const RadiationModel field(input.emitters, input.materials, input.air, late_boost);
  SignalWeights weights;
  weights.by_signal.assign(input.signals.size(), {1, 2, 3, 4, 5, 4, 3, 2});

  // Sums are kept by band, octant and delay; the last delay bin holds all later delays.
  struct Place {
    Bands intensity;
    std::size_t octant, delay;
  };
  std::vector<Place> sources;
  std::vector<Statistics> cells(kBandCount * kOctants * kDelays);
  std::vector<Statistics> bands(kBandCount), octants(kOctants), delays(kDelays);
  const auto each = [&](const Place& source, double scale, auto&& take) {
    for (std::size_t b = 0; b < kBandCount; ++b) {
      const double power = scale * static_cast<double>(source.intensity[b]);
      take(bands[b], power);
      take(octants[source.octant], power);
      take(delays[source.delay], power);
      take(cells[(b * kOctants + source.octant) * kDelays + source.delay], power);
    }
  };
  for (const Source& source : input.sources) {
    const Vec3 from = Vec3(source.position_m) - kListener;
    const double delay_s =
        field.delay_s(source, kListener) - input.emitters[source.emitter].delay_s;
    sources.push_back({field.intensity(source, kListener),
                       (from.x > 0 ? 1u : 0u) + (from.y > 0 ? 2u : 0u) + (from.z > 0 ? 4u : 0u),
                       std::min(static_cast<std::size_t>(delay_s / kDelayBin_s), kDelays - 1)});
    each(sources.back(), 1, [](Statistics& of, double power) { of.whole += power; });
  }

  std::vector<std::vector<Statistics>*> all = {&bands, &octants, &delays, &cells};
  for (std::uint32_t roll = 0; roll < kRolls; ++roll) {
    for (std::uint32_t i = 0; i < input.sources.size(); ++i)
      input.sources[i].u = static_cast<float>(unit_above_zero(philox(rolls, {i, roll, 0, 0})[0]));
    SourceList list(field, weights, input.sources);
    const auto sampler = make_priority_sampler(field, weights, list, voices);
    std::vector<std::vector<double>> estimates;
    for (const auto* of : all) estimates.emplace_back(of->size());
    for (const SampledSource& chosen : sampler->sample(kListener))
      each(sources[chosen.number], chosen.power_scale, [&](Statistics& of, double power) {
        for (std::size_t g = 0; g < all.size(); ++g)
          if (&of >= all[g]->data() && &of < all[g]->data() + all[g]->size())
            estimates[g][static_cast<std::size_t>(&of - all[g]->data())] += power;
      });
    for (std::size_t g = 0; g < all.size(); ++g)
      for (std::size_t i = 0; i < all[g]->size(); ++i) (*all[g])[i].add(estimates[g][i]);
  }

  // There are 26 sums. With other random numbers one of them would exceed 3 standard errors in one
  // of 14 runs.
  for (std::size_t b = 0; b < kBandCount; ++b) EXPECT_LT(std::abs(bands[b].off()), 3) << b;
  for (std::size_t o = 0; o < kOctants; ++o) EXPECT_LT(std::abs(octants[o].off()), 3) << o;
  for (std::size_t d = 0; d < kDelays; ++d) EXPECT_LT(std::abs(delays[d].off()), 3) << d;

  // There are 640 sums of one band, octant and delay, of which 1.7 are expected beyond 3 standard
  // errors. The eight bands of an octant and delay are correlated, so chance produces eight at
  // once.
  int beyond = 0, heard = 0;
  for (const Statistics& cell : cells) {
    if (cell.whole == 0) continue;
    ++heard;
    beyond += std::abs(cell.off()) > 3;
  }
  EXPECT_GT(heard, 300);
  EXPECT_LE(beyond, 8);
}

TEST(PrioritySampling, IsUnbiasedInEachBandOctantAndDelay) {
  expect_unbiased_sampling({}, kChosen, 21);
}

TEST(PrioritySampling, IsUnbiasedWithBoostedLateSources) {
  expect_unbiased_sampling(LateBoost(0.15), kChosen, 22);
}

}  // namespace
}  // namespace clamor
