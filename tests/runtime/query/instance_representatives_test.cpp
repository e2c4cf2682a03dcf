// instance_representatives_test.cpp: distant instances are represented by one source, without
// traversing them.
#include "runtime/query/instance_representatives.h"

#include <cmath>
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
#include "tests/sanitized.h"
#include "tests/stored_tree.h"

namespace clamor {
namespace {

double power_of(const Source& source) {
  return std::accumulate(source.power.begin(), source.power.end(), 0.0);
}

// Four levels: groups of lobes and cones; rows of groups, some with sources beside their instances,
// and so many instances that they fill several nodes; blocks of rows; and a level of blocks.
struct Nested {
  explicit Nested(std::uint64_t seed) : seed_(seed) {
    for (const float exponent : {0.0f, 20.0f}) {
      materials.emplace_back().scattering = same_in_all_bands(0.1f);
      materials.back().phong = same_in_all_bands(exponent);
    }
    for (std::uint32_t e = 0; e < 6; ++e) {
      Emitter& emitter = emitters.emplace_back();
      emitter.position_m = {0.5 * e, 1, 0};
      emitter.axis = glm::normalize(Vec3(1, 0, e - 2.5));
      emitter.directivity = same_in_all_bands(static_cast<float>(3 * (e % 3)));
      emitter.signal = e % 3;
    }
    weights.by_signal = {
        {1, 2, 3, 4, 5, 4, 3, 2}, {0, 0, 0, 0, 0, 1, 2, 9}, {3, 1, 0, 0, 0, 0, 0, 0}};
    maps = {{1, 2, 0}, {0, 0, 1}};
    std::size_t first = 0;
    for (std::uint32_t v = 0; v < 3; ++v) {
      auto group = some_sources(v, 8, 3);
      draw_prototype_u(group, seed * 10 + v);
      add(build_octree(std::move(group)));
    }
    first = add_copies(0, 3, 600, 20, false);
    first = add_copies(first, 3, 3, 60, true);
    std::vector<Instance> top = copies_of(40, first, 10, 900);
    draw_instance_u(top, seed);
    add(with_instances(build_octree(some_sources(50, 200, 500)), std::move(top), tops));
  }

  // Adds three variants of a tree of instances of the three trees from `inner` on; returns the
  // index of the first.
  std::size_t add_copies(std::size_t inner, std::uint32_t variants, std::uint32_t count,
                         double size, bool with_sources) {
    const std::size_t first = tops.size();
    for (std::uint32_t v = 0; v < variants; ++v) {
      std::vector<Instance> copies = copies_of(7, inner, count, size);
      if (!with_sources) {
        draw_prototype_u(copies, tops, seed_ * 100 + first + v);
        add(instance_tree(std::move(copies), tops));
      } else {
        // One choice among sources and instances, in proportion to their power.
        auto sources = some_sources(8, 40, size);
        std::vector<Source> choice = sources;
        for (const Instance& copy : copies) {
          Source& stands = choice.emplace_back();
          stands.position_m = Vec3f(copy.offset_m);
          stands.power[0] = static_cast<float>(static_cast<double>(copy.gain) * copy.gain *
                                               total_power(tops[copy.tree]));
        }
        draw_prototype_u(choice, seed_ * 100 + first + v);
        for (std::size_t i = 0; i < sources.size(); ++i) sources[i].u = choice[i].u;
        for (std::size_t i = 0; i < copies.size(); ++i) copies[i].u = choice[sources.size() + i].u;
        add(with_instances(build_octree(std::move(sources)), std::move(copies), tops));
      }
    }
    return first;
  }

  void add(const SourceOctree& tree) {
    tops.push_back(root_entry(tree, tops));
    trees.add(tree);
  }

  std::vector<Source> some_sources(std::uint32_t stream, std::uint32_t count, double size) const {
    std::vector<Source> sources;
    for (std::uint32_t i = 0; i < count; ++i) {
      const RandomBits a = philox(seed_, {i, stream, 0, 1}), b = philox(seed_, {i, stream, 1, 1});
      Source& source = sources.emplace_back();
      source.position_m = Vec3f(size * Vec3(unit(a[0]), 0.2 * unit(a[1]), unit(a[2])));
      source.normal = Vec3f(glm::normalize(Vec3(unit(b[0]) - 0.5, unit(b[1]), unit(b[2]) - 0.5)));
      source.mirror = source.normal;
      source.patch_radius_m = static_cast<float>(0.5 * unit(a[2]));
      for (std::size_t band = 0; band < kBandCount; ++band)
        source.power[band] = static_cast<float>(std::pow(10, -2 * unit(a[3]) - 0.1 * band));
      source.emitter = b[3] % 6;
      source.material = static_cast<std::uint16_t>(b[3] / 8 % 2);
      source.u = static_cast<float>(unit_above_zero(b[3]));
      if (i % 3 == 0) set_from_emitter(source, emitters[source.emitter]);
    }
    return sources;
  }

  std::vector<Instance> copies_of(std::uint32_t stream, std::size_t inner, std::uint32_t count,
                                  double size) const {
    std::vector<Instance> copies;
    for (std::uint32_t i = 0; i < count; ++i) {
      const RandomBits a = philox(seed_, {i, stream, 0, 2}), b = philox(seed_, {i, stream, 1, 2});
      Instance& copy = copies.emplace_back();
      copy.tree = static_cast<std::uint32_t>(inner) + a[3] % 3;
      copy.offset_m = size * Vec3(unit(a[0]), 0.1 * unit(a[1]), unit(a[2]));
      copy.rotation = glm::angleAxis(static_cast<float>(2 * std::numbers::pi * unit(b[0])),
                                     glm::normalize(glm::vec3(0.2, 1, 0.1)));
      copy.scale = static_cast<float>(1 - 0.4 * unit(b[1]));
      copy.gain = static_cast<float>(0.3 + unit(b[2]));
      copy.signals = b[3] % 3 == 0 ? kSameSignals : b[3] % 2;
    }
    return copies;
  }

  std::vector<Material> materials;
  std::vector<Emitter> emitters;
  SignalWeights weights;
  std::vector<std::vector<std::uint32_t>> maps;
  std::vector<PageEntry> tops;
  testing::StoredTrees trees;

 private:
  std::uint64_t seed_;
};

TEST(InstanceRepresentatives, AreTheSourcesWithTheHighestKeysAndKnowTheNextKey) {
  for (std::uint64_t seed = 0; seed < 3; ++seed) {
    const Nested nested(seed);
    const RadiationModel radiation(nested.emitters, nested.materials, Air{});
    PageLoader loader(nested.trees.fetch(radiation, nested.weights), PageBudget{1'000'000'000});
    SignalMaps maps(nested.maps);
    InstanceRepresentatives representatives(radiation, nested.trees.tops(), maps);
    representatives.update([&](const PageEntry& entry) {
      EXPECT_TRUE(loader.load_now(entry));
      return loader.find(entry);
    });
    for (std::size_t tree = 0; tree + 1 < nested.tops.size(); ++tree) {
      const auto all = nested.trees.sources_of_tree(tree);
      const auto signals = nested.trees.signals_of_tree(tree, nested.emitters, nested.maps);
      std::size_t first = 0;
      const auto key = [&](std::size_t i) { return power_of(all[i]) / all[i].u; };
      for (std::size_t i = 0; i < all.size(); ++i)
        if (key(i) > key(first)) first = i;
      const InstanceRepresentative* const representative =
          representatives.of(static_cast<std::uint32_t>(tree));
      ASSERT_NE(representative, nullptr);
      EXPECT_EQ(representative->number, first) << tree;
      EXPECT_LT(length(representative->position_m - Vec3(all[first].position_m)), 1e-3);
      EXPECT_NEAR(representative->power, power_of(all[first]), 1e-5 * representative->power);
      EXPECT_EQ(representative->signal, signals[first]);
      double next = 0;
      for (std::size_t i = 0; i < all.size(); ++i)
        if (i != first) next = std::max(next, key(i));
      EXPECT_GE(representative->rest_key, next * (1 - 1e-5));
      EXPECT_LT(next, total_power(nested.tops[tree]) * (1 + 1e-5));
    }
  }
}

// Listeners are among the sources, beside them and kilometres away; there are few voices or many.
TEST(InstanceRepresentatives, GiveTheSampleOfAScanOfAllSourcesOfNestedInstances_NoAsan) {
  const std::uint64_t seeds = testing::kSanitized ? 1 : 3;
  for (std::uint64_t seed = 0; seed < seeds; ++seed) {
    const Nested nested(seed);
    const RadiationModel radiation(nested.emitters, nested.materials, Air{});
    const SignalWeights ceilings = max_over_instances(nested.weights, nested.maps);
    const std::vector<Source> all = nested.trees.all_sources();
    const auto signals = nested.trees.signals(nested.emitters, nested.maps);
    PageLoader loader(nested.trees.fetch(radiation, ceilings), PageBudget{1'000'000'000});
    OctreePool pool(radiation, ceilings, nested.trees.tops(), nested.maps, loader);
    for (const std::size_t voices : {1u, 20u, 400u}) {
      const auto sampler = make_priority_sampler(radiation, nested.weights, pool, voices);
      for (std::uint32_t i = 0; i < 6; ++i) {
        const RandomBits bits = philox(seed, {i, 3, 3, 3});
        const double far_m = i % 3 == 2 ? 5000 : 900;
        const Vec3 place(far_m * unit(bits[0]), 10 * unit(bits[1]), far_m * unit(bits[2]));
        auto sample = sampler->sample(place);
        while (!sampler->complete()) sample = sampler->sample(place);
        std::vector<bool> chosen(all.size(), false);
        double least = 1e300;
        for (const SampledSource& one : sample) {
          ASSERT_LT(one.number, all.size());
          ASSERT_FALSE(chosen[one.number]);
          chosen[one.number] = true;
          ASSERT_EQ(one.signal, signals[one.number]);
          ASSERT_NEAR(one.source->u, all[one.number].u, 1e-4 * one.source->u);
          const double w =
              weight(radiation, nested.weights.by_signal[one.signal], *one.source, place);
          least = std::min(least, w / one.source->u);
        }
        for (std::size_t s = 0; s < all.size(); ++s)
          if (!chosen[s] && sample.size() == voices) {
            const double w = weight(radiation, nested.weights.by_signal[signals[s]], all[s], place);
            ASSERT_LE(w / all[s].u, least * (1 + 1e-3)) << seed << " " << voices << " " << i;
          }
        ASSERT_GT(sample.size(), 0u);
      }
    }
    EXPECT_GT(pool.representatives_found(), 100u);
  }
}

}  // namespace
}  // namespace clamor
