// octree_pool_city_test.cpp: a billion sources in a file of a few megabytes.
#include <memory>

#include <gtest/gtest.h>

#include "runtime/propagation/source_weight.h"
#include "runtime/query/octree_pool.h"
#include "runtime/sampling/sampler.h"
#include "tests/city.h"
#include "tests/runtime/complete_sample.h"
#include "tests/sanitized.h"
#include "tests/temporary_file.h"

namespace clamor {
namespace {

struct OpenCity {
  OpenCity(const testing::CitySize& size, std::uint64_t seed)
      : file(testing::as_file(testing::city(size, seed))) {
    radiation = std::make_unique<RadiationModel>(file->emitters(), file->materials(), Air{});
    weights.by_signal = {
        {1, 2, 3, 4, 5, 4, 3, 2}, {2, 2, 1, 1, 1, 1, 2, 2}, {1, 1, 1, 4, 4, 1, 1, 1}};
    ceilings = max_over_instances(weights, file->signal_maps());
    loader = std::make_unique<PageLoader>(page_fetch(*file, *radiation, ceilings),
                                          PageBudget{20'000'000});
    pool = std::make_unique<OctreePool>(*radiation, ceilings, file->trees(), file->signal_maps(),
                                        *loader);
  }

  const std::shared_ptr<const BakeFile> file;
  std::unique_ptr<RadiationModel> radiation;
  SignalWeights weights, ceilings;
  std::unique_ptr<PageLoader> loader;
  std::unique_ptr<OctreePool> pool;
};

// Received power of all fans: exact for near blocks; for others as if all fans stood at
// the centre, with a relative error of (size / distance)^2.
class WholeCity {
 public:
  WholeCity(const testing::CitySize& size, const OpenCity& city) : city_(city) {
    const BakeContents bake = testing::city(size, 1);
    fans_ = bake.prototypes[0].sources;
    const auto level = [&](std::size_t tree) { return bake.prototypes[tree].instances; };
    blocks_ = level(size.variants);
    stands_ = level(2 * size.variants);
    stadiums_ = bake.octree.instances;
    maps_ = bake.signal_maps;
    for (std::uint32_t s = 0; s < 3; ++s)
      for (const Source& fan : fans_)
        if (bake.emitters[fan.emitter].signal == s)
          for (std::size_t b = 0; b < kBandCount; ++b) power_[s][b] += fan.power[b];
  }

  double at(const Vec3& place) const {
    double sum = 0;
    for (const Instance& stadium : stadiums_)
      for (const Instance& stand : stands_)
        for (const Instance& block : blocks_) {
          const Placement placed = Placement{}.then(stadium).then(stand).then(block);
          std::array<std::uint32_t, 3> plays = {0, 1, 2};
          for (std::uint32_t& signal : plays)
            for (const Instance* copy : {&block, &stand, &stadium})
              if (copy->signals != kSameSignals) signal = maps_[copy->signals][signal];
          if (length(placed.offset_m - place) < 150) {
            for (const Source& fan : fans_)
              sum += weight(*city_.radiation,
                            city_.weights.by_signal[plays[city_.radiation->signal(fan)]],
                            placed.place(fan), place);
          } else {
            for (std::uint32_t s = 0; s < 3; ++s) {
              Source together;
              together.is_emitter = true;
              together.power = power_[s];
              together.position_m = Vec3f(placed.outside({0, 2, 0}));
              sum += weight(*city_.radiation, city_.weights.by_signal[plays[s]], together, place);
            }
          }
        }
    return sum;
  }

 private:
  const OpenCity& city_;
  std::vector<Source> fans_;
  std::vector<Instance> blocks_, stands_, stadiums_;
  std::vector<std::vector<std::uint32_t>> maps_;
  std::array<Bands, 3> power_{};
};

TEST(City, OfABillionFansNeedsAFewMegabytesOfDiskAndMemory) {
  const testing::CitySize size;
  const OpenCity city(size, 1);
  EXPECT_EQ(city.file->source_count(), 1'000'000'000u);
  EXPECT_LT(city.file->bytes().file, 20'000'000u);
  const auto sampler = make_priority_sampler(*city.radiation, city.weights, *city.pool, 2000);
  for (int i = 0; i < 20; ++i)
    testing::complete_sample(*sampler, {1000.0 * i, 2, 10'000 - 400.0 * i});
  EXPECT_EQ(city.loader->statistics().failed, 0u);
  EXPECT_LT(city.loader->statistics().bytes, 20'000'000u);
}

TEST(City, IsUnbiased_NoAsan) {
  // A hundred thousand blocks suffice for the statistics and are few enough to be summed.
  testing::CitySize size;
  size.stadiums = 10;
  const Vec3 inside(2400, 2, 2500), above(3000, 800, 4000);
  double whole_inside = 0, whole_above = 0;
  std::vector<double> ratios_inside, ratios_above;
  const std::uint64_t seeds = testing::kSanitized ? 6 : 25;
  for (std::uint64_t seed = 1; seed <= seeds; ++seed) {
    const OpenCity city(size, seed);
    if (seed == 1) {
      const WholeCity whole(size, city);
      whole_inside = whole.at(inside);
      whole_above = whole.at(above);
    }
    const auto sampler = make_priority_sampler(*city.radiation, city.weights, *city.pool, 2000);
    const auto heard = [&](const Vec3& place) {
      double sum = 0;
      const auto sample = testing::complete_sample(*sampler, place);
      EXPECT_EQ(sample.size(), 2000u);
      for (const SampledSource& one : sample)
        sum += one.power_scale *
               weight(*city.radiation, city.weights.by_signal[one.signal], *one.source, place);
      return sum;
    };
    ratios_inside.push_back(heard(inside) / whole_inside);
    ratios_above.push_back(heard(above) / whole_above);
  }
  for (const auto* ratios : {&ratios_inside, &ratios_above}) {
    double mean = 0, squares = 0;
    for (const double ratio : *ratios) mean += ratio / static_cast<double>(ratios->size());
    for (const double ratio : *ratios) squares += (ratio - mean) * (ratio - mean);
    const double sigma = std::sqrt(squares / static_cast<double>(ratios->size() - 1));
    EXPECT_LT(sigma, 1 / std::sqrt(1999.0));  // the bound of priority sampling
    EXPECT_NEAR(mean, 1, 3 * sigma / std::sqrt(static_cast<double>(ratios->size())) + 0.002);
  }
}

}  // namespace
}  // namespace clamor
