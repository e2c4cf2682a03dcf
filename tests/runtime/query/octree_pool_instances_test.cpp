// octree_pool_instances_test.cpp: sources that are stored once and instanced many times.
#include <array>
#include <cmath>
#include <iterator>
#include <numbers>
#include <numeric>

#include <gtest/gtest.h>

#include "bake/instances/instance_tree.h"
#include "bake/octree/octree_builder.h"
#include "common/random.h"
#include "formats/bake_file/page.h"
#include "runtime/propagation/source_weight.h"
#include "runtime/query/octree_pool.h"
#include "runtime/sampling/sampler.h"
#include "tests/runtime/complete_sample.h"
#include "tests/sanitized.h"
#include "tests/stored_tree.h"

namespace clamor {
namespace {

constexpr std::uint32_t kVariants = 8;

glm::quat turn(double angle) {
  return glm::angleAxis(static_cast<float>(angle), glm::vec3(0, 1, 0));
}

// A block of fans and the reflections of its floor; stands of blocks; a stadium of stands and a
// hall.
struct Stadium {
  Stadium(std::uint64_t seed, std::uint32_t sources_in_block, std::uint32_t blocks,
          std::uint32_t stands, std::uint32_t alone) {
    materials.resize(2);
    materials[1].scattering = same_in_all_bands(0.2f);
    materials[1].phong = same_in_all_bands(20);
    weights.by_signal = {{1, 2, 3, 4, 5, 4, 3, 2}, {0.1f, 0, 0, 0, 0, 0, 0.5f, 2}, {0, 1, 9, 0}};
    maps = {{1, 2, 0}, {2, 2, 2}};
    for (std::uint32_t e = 0; e < 8; ++e) {
      Emitter& emitter = emitters.emplace_back();
      emitter.position_m = {0.7 * e, 1, 0.3 * e};
      emitter.signal = e % 2;
      emitter.directivity = same_in_all_bands(static_cast<float>(e % 3));
      emitter.axis = glm::normalize(Vec3(1, 0.1 * e, -1));
    }
    for (std::uint32_t variant = 0; variant < kVariants; ++variant) {
      std::vector<Source> block = sources_of(seed, sources_in_block, {8, 3, 5});
      draw_prototype_u(block, seed * 100 + variant);
      add(build_octree(std::move(block)));
    }
    for (std::uint32_t variant = 0; variant < kVariants; ++variant) {
      std::vector<Instance> copies = copies_of(seed + 10 + variant, blocks, 0, {60, 5, 20});
      draw_prototype_u(copies, tops, seed * 100 + 50 + variant);
      add(instance_tree(std::move(copies), tops));
    }
    std::vector<Instance> copies = copies_of(seed + 20, stands, kVariants, {200, 5, 150});
    draw_instance_u(copies, seed);
    std::vector<Source> further = sources_of(seed + 1, alone, {200, 5, 150});
    add(with_instances(build_octree(std::move(further)), std::move(copies), tops));
  }

  void add(const SourceOctree& tree) {
    tops.push_back(root_entry(tree, tops));
    trees.add(tree);
  }

  std::vector<Source> sources_of(std::uint64_t seed, std::uint32_t count, const Vec3& size) const {
    std::vector<Source> sources;
    for (std::uint32_t i = 0; i < count; ++i) {
      const RandomBits a = philox(seed, {i, 0, 0, 0}), b = philox(seed, {i, 1, 0, 0}),
                       c = philox(seed, {i, 2, 0, 0});
      Source& source = sources.emplace_back();
      source.position_m = Vec3f(size * Vec3(unit(a[0]), unit(a[1]), unit(a[2])));
      source.normal = Vec3f(glm::normalize(Vec3(unit(b[0]) - 0.5, unit(b[1]), unit(b[2]) - 0.5)));
      source.mirror = source.normal;
      source.delay_s = static_cast<float>(unit(c[0]));
      source.patch_radius_m = static_cast<float>(unit(c[1]));
      for (std::size_t band = 0; band < kBandCount; ++band)
        source.power[band] = static_cast<float>(std::pow(10, -3 * unit(a[3]) - 0.1 * band));
      source.emitter = c[2] % 8;
      source.material = c[3] % 2;
      source.u = static_cast<float>(unit_above_zero(b[3]));
      if (i % 10 == 0) set_from_emitter(source, emitters[source.emitter]);
    }
    return sources;
  }

  std::vector<Instance> copies_of(std::uint64_t seed, std::uint32_t count, std::uint32_t first_tree,
                                  const Vec3& size) const {
    std::vector<Instance> copies;
    for (std::uint32_t i = 0; i < count; ++i) {
      const RandomBits a = philox(seed, {i, 5, 0, 0}), b = philox(seed, {i, 6, 0, 0});
      Instance& copy = copies.emplace_back();
      copy.tree = first_tree + a[3] % kVariants;
      copy.offset_m = size * Vec3(unit(a[0]), unit(a[1]), unit(a[2]));
      copy.rotation = turn(2 * std::numbers::pi * unit(b[0]));
      copy.scale = static_cast<float>(1 - 0.5 * unit(b[1]));
      copy.gain = static_cast<float>(0.3 + unit(b[2]));
      copy.delay_s = static_cast<float>(unit(b[3]));
      copy.signals = i % 3 == 0 ? kSameSignals : i % 2;
    }
    return copies;
  }

  RadiationModel radiation(const LateBoost& late_boost = {}) const {
    return {emitters, materials, Air{}, late_boost};
  }

  // Signal of every source, in the order of StoredTrees::all_sources().
  std::vector<std::uint32_t> played() const { return trees.signals(emitters, maps); }

  std::vector<Material> materials;
  std::vector<Emitter> emitters;
  SignalWeights weights;
  std::vector<std::vector<std::uint32_t>> maps;
  std::vector<PageEntry> tops;
  testing::StoredTrees trees;
};

double band_sum(const Source& source) {
  return std::accumulate(source.power.begin(), source.power.end(), 0.0);
}

TEST(PrototypeU, GivesOneSourceAKeyAboveTheTotalPowerAndIsUniform) {
  constexpr int kSeeds = 4000;
  const Stadium stadium(1, 40, 2, 1, 0);
  std::vector<Source> sources = stadium.sources_of(7, 12, {1, 1, 1});
  double total = 0;
  for (const Source& source : sources) total += band_sum(source);
  std::vector<double> below_a_tenth(sources.size(), 0), highest(sources.size(), 0);
  for (int seed = 0; seed < kSeeds; ++seed) {
    draw_prototype_u(sources, static_cast<std::uint64_t>(seed));
    int above = 0;
    for (std::size_t i = 0; i < sources.size(); ++i) {
      ASSERT_TRUE(sources[i].u > 0 && sources[i].u <= 1);
      const bool is_above = band_sum(sources[i]) / sources[i].u > total * (1 - 1e-6);
      above += is_above;
      highest[i] += is_above;
      below_a_tenth[i] += sources[i].u < 0.1f;
    }
    ASSERT_EQ(above, 1);
  }
  for (std::size_t i = 0; i < sources.size(); ++i) {
    const auto sigma = [](double p) { return std::sqrt(p * (1 - p) * kSeeds); };
    EXPECT_NEAR(below_a_tenth[i], 0.1 * kSeeds, 4.5 * sigma(0.1)) << i;
    const double share = band_sum(sources[i]) / total;
    EXPECT_NEAR(highest[i], share * kSeeds, 4.5 * sigma(share) + 1) << i;
  }
}

// Nested instances with rotation, scale, gain and other signals, and sources outside any instance.
TEST(Instances, GiveTheSampleOfAScanOfAllTheirSources_NoAsan) {
  const std::uint64_t seeds = testing::kSanitized ? 2 : 4;
  for (std::uint64_t seed = 0; seed < seeds; ++seed) {
    const Stadium stadium(seed, seed % 2 == 0 ? 40 : 1500, 20, 30, seed < 2 ? 3000 : 0);
    // Late sources are boosted, but not those of instances; the last seeds boost none.
    const RadiationModel radiation = stadium.radiation(LateBoost(seed < 2 ? 0 : 0.6));
    const SignalWeights ceilings = max_over_instances(stadium.weights, stadium.maps);
    const std::vector<Source> all = stadium.trees.all_sources();
    const std::vector<std::uint32_t> signals = stadium.played();
    ASSERT_EQ(all.size(), stadium.tops.back().sources_below);
    for (const std::size_t voices : {1u, 40u, 1000u}) {
      PageLoader loader(stadium.trees.fetch(radiation, ceilings), PageBudget{1'000'000'000});
      OctreePool pool(radiation, ceilings, stadium.trees.tops(), stadium.maps, loader);
      const auto sampler = make_priority_sampler(radiation, stadium.weights, pool, voices);
      for (std::uint32_t i = 0; i < 4; ++i) {
        const RandomBits bits = philox(seed, {i, 9, 0, 0});
        const Vec3 place = i < 2
                               ? Vec3(90 + 0.1 * i, 2, 80)
                               : Vec3(300 * unit(bits[0]), 10 * unit(bits[1]), 200 * unit(bits[2]));
        const auto found = testing::complete_sample(*sampler, place);
        // The sample is complete, its sources have the right signals, and no source of higher
        // priority is missing.
        ASSERT_EQ(found.size(), voices);
        double least = 1e300;
        std::vector<bool> chosen(all.size(), false);
        for (const SampledSource& one : found) {
          ASSERT_LT(one.number, all.size());
          const Source& expected = all[one.number];
          ASSERT_LT(length(one.source->position_m - expected.position_m), 2e-4f);
          ASSERT_LT(length(one.source->normal - expected.normal), 1e-5f);
          ASSERT_NEAR(one.source->u, expected.u, 1e-5 * expected.u);
          ASSERT_NEAR(band_sum(*one.source), band_sum(expected), 1e-5 * band_sum(expected));
          ASSERT_EQ(one.source->emitter, expected.emitter);
          const double w =
              weight(radiation, stadium.weights.by_signal[one.signal], *one.source, place);
          least = std::min(least, w / one.source->u);
          chosen[one.number] = true;
        }
        for (std::size_t s = 0; s < all.size(); ++s)
          if (!chosen[s]) {
            const double w =
                weight(radiation, stadium.weights.by_signal[signals[s]], all[s], place);
            ASSERT_LE(w / all[s].u, least * (1 + 1e-4)) << seed << " " << voices << " " << s;
          }
      }
    }
  }
}

// Twenty kilometres from the origin a float is off by a millimetre: a source ten centimetres away
// is some percent louder than in the space of its instance, and its direction changes.
TEST(Instances, MissNoSourceFarFromTheOrigin) {
  Stadium stadium(31, 10, 1, 1, 0);
  std::vector<Source> block = stadium.sources_of(3, 4000, {3, 3, 3});
  draw_prototype_u(block, 4);
  Instance copy;
  copy.tree = static_cast<std::uint32_t>(stadium.tops.size());
  copy.offset_m = {-17'000.123, 50.37, 16'000.456};
  copy.rotation = turn(0.7);
  copy.scale = 0.05f;
  stadium.add(build_octree(std::move(block)));
  stadium.add(instance_tree({copy}, stadium.tops));
  const RadiationModel radiation = stadium.radiation();
  const SignalWeights ceilings = max_over_instances(stadium.weights, stadium.maps);
  const std::vector<Source> all = stadium.trees.all_sources();
  const auto signals = stadium.played();
  PageLoader loader(stadium.trees.fetch(radiation, ceilings), PageBudget{1'000'000'000});
  OctreePool pool(radiation, ceilings, stadium.trees.tops(), stadium.maps, loader);
  const auto sampler = make_priority_sampler(radiation, stadium.weights, pool, 100);
  for (std::uint32_t i = 0; i < 200; ++i) {
    const RandomBits bits = philox(32, {i, 0, 0, 0});
    const Vec3 place =
        Placement{}.then(copy).outside(3.0 * Vec3(unit(bits[0]), unit(bits[1]), unit(bits[2])));
    double least = 1e300;
    std::vector<bool> chosen(all.size(), false);
    const auto priority = [&](std::size_t s) {
      return weight(radiation, stadium.weights.by_signal[signals[s]], all[s], place) / all[s].u;
    };
    for (const SampledSource& one : testing::complete_sample(*sampler, place)) {
      least = std::min(least, priority(one.number));
      chosen[one.number] = true;
    }
    for (std::size_t s = 0; s < all.size(); ++s)
      if (!chosen[s]) {
        ASSERT_LE(priority(s), least * (1 + 1e-9)) << i << " " << s;
      }
  }
}

// There are far fewer voices than instances, so nearly every instance is represented by one source
// or not at all.
TEST(Instances, AreUnbiased_NoAsan) {
  constexpr int kSeeds = testing::kSanitized ? 12 : 40;
  constexpr std::size_t kVoices[] = {30, 300};
  std::array<double, std::size(kVoices)> sum{}, squares{};
  for (int seed = 0; seed < kSeeds; ++seed) {
    const Stadium stadium(1000 + static_cast<std::uint64_t>(seed), 60, 40, 60, 0);
    const RadiationModel radiation = stadium.radiation();
    const SignalWeights ceilings = max_over_instances(stadium.weights, stadium.maps);
    const Vec3 place(100, 60, 75);
    const auto signals = stadium.played();
    const auto all = stadium.trees.all_sources();
    double whole = 0;
    for (std::size_t s = 0; s < all.size(); ++s)
      whole += weight(radiation, stadium.weights.by_signal[signals[s]], all[s], place);
    for (std::size_t v = 0; v < std::size(kVoices); ++v) {
      PageLoader loader(stadium.trees.fetch(radiation, ceilings), PageBudget{1'000'000'000});
      OctreePool pool(radiation, ceilings, stadium.trees.tops(), stadium.maps, loader);
      const auto sampler = make_priority_sampler(radiation, stadium.weights, pool, kVoices[v]);
      double heard = 0;
      for (const SampledSource& one : testing::complete_sample(*sampler, place))
        heard += one.power_scale *
                 weight(radiation, stadium.weights.by_signal[one.signal], *one.source, place);
      sum[v] += heard / whole;
      squares[v] += heard / whole * heard / whole;
    }
  }
  for (std::size_t v = 0; v < std::size(kVoices); ++v) {
    const double mean = sum[v] / kSeeds, sigma = std::sqrt(squares[v] / kSeeds - mean * mean);
    EXPECT_NEAR(mean, 1, 3 * sigma / std::sqrt(kSeeds)) << kVoices[v];
    EXPECT_LT(sigma, 1.5 / std::sqrt(static_cast<double>(kVoices[v]) - 1)) << kVoices[v];
  }
}

}  // namespace
}  // namespace clamor
