// city.h: a city of stadiums of stands of blocks of fans; a billion sources with the default
// counts.
//
// Every fan of a block is an omnidirectional emitter in the emitter table; everything else is
// instances.
#pragma once

#include <cmath>
#include <numbers>
#include <string>

#include "bake/instances/instance_tree.h"
#include "bake/octree/octree_builder.h"
#include "common/random.h"
#include "formats/bake_file/bake_contents.h"
#include "formats/bake_file/page.h"

namespace clamor::testing {

struct CitySize {
  std::uint32_t fans = 1000;  // per block
  std::uint32_t blocks = 100, stands = 100, stadiums = 100;
  std::uint32_t variants = 8;

  std::uint64_t sources() const { return std::uint64_t{fans} * blocks * stands * stadiums; }
};

// `count` instances on a grid with spacing `step_m`, with jitter, quarter turns and random
// variants.
inline std::vector<Instance> on_a_grid(std::uint32_t count, double step_m, std::uint32_t first_tree,
                                       std::uint32_t variants, std::uint64_t seed) {
  const auto side = static_cast<std::uint32_t>(std::ceil(std::sqrt(count)));
  std::vector<Instance> instances(count);
  for (std::uint32_t i = 0; i < count; ++i) {
    const RandomBits bits = philox(seed, {i, 0, first_tree, 0});
    Instance& instance = instances[i];
    instance.tree = first_tree + bits[0] % variants;
    const double x = i % side, z = static_cast<double>(i / side);
    instance.offset_m = step_m * Vec3(x + 0.1 * unit(bits[1]), 0, z + 0.1 * unit(bits[2]));
    instance.rotation = glm::angleAxis(static_cast<float>(std::numbers::pi / 2 * (bits[3] % 4)),
                                       glm::vec3(0, 1, 0));
    instance.signals = i % 3 == 0 ? kSameSignals : i % 2;
    instance.delay_s = static_cast<float>(i % 7);
  }
  return instances;
}

// `seed` determines only the sources' random numbers u; places and levels are the same for each.
inline BakeContents city(const CitySize& size, std::uint64_t seed) {
  BakeContents bake;
  bake.provenance.tool = "clamor test";
  bake.provenance.level = "city";
  for (std::uint32_t s = 0; s < 3; ++s) {
    Signal& signal = bake.signals.emplace_back();
    signal.name = "signal " + std::to_string(s);
    for (int i = 0; i < 4800; ++i)
      signal.samples.push_back(
          static_cast<float>(0.3 * std::sin(2 * std::numbers::pi * 100 * (s + 1) * i / 4800)));
  }
  bake.signal_maps = {{1, 2, 0}, {2, 0, 1}};

  std::vector<Source> fans;
  for (std::uint32_t f = 0; f < size.fans; ++f) {
    const RandomBits bits = philox(1, {f, 1, 0, 0});
    Emitter& emitter = bake.emitters.emplace_back();
    emitter.name = "fan " + std::to_string(f);
    emitter.position_m = {8 * unit(bits[0]) - 4, 4 * unit(bits[1]), 8 * unit(bits[2]) - 4};
    emitter.gain = std::pow(10, -0.5 * unit(bits[3]));
    emitter.signal = f % 3;
    Source& source = fans.emplace_back();
    source.emitter = f;
    set_from_emitter(source, emitter);
  }

  std::vector<PageEntry> tops;
  const auto add = [&](SourceOctree tree) {
    tops.push_back(root_entry(tree, tops));
    bake.prototypes.push_back(std::move(tree));
  };
  for (std::uint32_t v = 0; v < size.variants; ++v) {
    draw_prototype_u(fans, seed * 1000 + v);
    add(build_octree(fans));
  }
  std::uint32_t first = 0;
  const auto add_instances = [&](std::uint32_t count, double step_m, std::uint64_t level) {
    const auto next = static_cast<std::uint32_t>(tops.size());
    for (std::uint32_t v = 0; v < size.variants; ++v) {
      auto instances = on_a_grid(count, step_m, first, size.variants, level);
      draw_prototype_u(instances, tops, seed * 1000 + 100 * level + v);
      add(instance_tree(std::move(instances), tops));
    }
    first = next;
  };
  add_instances(size.blocks, 10, 1);
  add_instances(size.stands, 150, 2);
  auto stadiums = on_a_grid(size.stadiums, 2000, first, size.variants, 3);
  draw_instance_u(stadiums, seed);
  bake.octree = instance_tree(std::move(stadiums), tops);
  return bake;
}

}  // namespace clamor::testing
