// paper_scenes.h: the two scenes of the paper, baked.
#pragma once

#include <memory>
#include <vector>

#include <gtest/gtest.h>

#include "bake/bake.h"
#include "common/random.h"
#include "formats/gltf/level_import.h"
#include "runtime/engine/auralizer_input.h"
#include "runtime/propagation/loudness.h"
#include "runtime/propagation/radiation_model.h"
#include "runtime/streaming/prepared_signal.h"
#include "tests/build_paths.h"
#include "tools/strategies/strategies.h"

namespace clamor::testing {

struct BakedScene {
  explicit BakedScene(AuralizerInput from)
      : input(std::move(from)),
        signals(prepare_signals(input.signals)),
        radiation(input.emitters, input.materials, input.air,
                  LateBoost(input.decay, input.sources.size())) {
    const Bands loudness = loudness_weights();
    for (const PreparedSignal& signal : signals) {
      Bands& weight = weights.by_signal.emplace_back();
      for (std::size_t b = 0; b < kBandCount; ++b)
        weight[b] = loudness[b] * signal.mean_square()[b];
    }
  }

  // Bakes a level of assets/levels; `phong` above 0 replaces all materials by mirrors with that
  // exponent.
  static std::unique_ptr<BakedScene> baked(const std::string& level, std::uint64_t sources,
                                           float phong = 0, std::uint64_t seed = 1) {
    auto imported =
        import_level(std::string(testing::kSourceDir) + "/assets/levels/" + level, ImportOptions{});
    EXPECT_TRUE(imported.ok());
    for (Material& material : imported->level.materials) {
      // The paper knows no sound through walls, and received() hears what is behind them in full.
      material.transmission = same_in_all_bands(0);
      if (phong > 0) {
        material.phong = same_in_all_bands(phong);
        material.scattering = same_in_all_bands(0);
      }
    }
    BakeOptions options;
    options.settings.sources = sources;
    options.settings.seed = seed;
    options.settings.early_order = 0;  // the paper knows no image sources
    auto contents = bake(imported->level, options);
    EXPECT_TRUE(contents.ok());
    return std::make_unique<BakedScene>(AuralizerInput{std::move(contents->octree.sources),
                                                       std::move(contents->emitters),
                                                       std::move(contents->signals),
                                                       std::move(contents->materials),
                                                       contents->settings.air,
                                                       {},
                                                       {},
                                                       contents->statistics.decay});
  }

  std::size_t size() const { return input.sources.size(); }

  // Mean square received from a source, per band.
  Bands received(std::size_t i, const Vec3& place) const {
    const Source& source = input.sources[i];
    Bands power = radiation.intensity(source, place);
    const Bands& of_signal = signals[radiation.signal(source)].mean_square();
    for (std::size_t b = 0; b < kBandCount; ++b) power[b] *= of_signal[b];
    return power;
  }

  // Twenty places at the height of a head, in the middle of the extent of emitters and walls.
  std::vector<Vec3> places() const {
    Vec3 low(1e9), high(-1e9);
    for (const Source& source : input.sources) {
      low = glm::min(low, Vec3(source.position_m));
      high = glm::max(high, Vec3(source.position_m));
    }
    std::vector<Vec3> places;
    for (std::uint32_t i = 0; i < 20; ++i) {
      const RandomBits bits = philox(77, {i, 0, 0, 0});
      const auto within = [&](std::uint32_t draw, double from, double to) {
        return from + (to - from) * (0.2 + 0.6 * unit(draw));
      };
      places.emplace_back(within(bits[0], low.x, high.x), low.y + 1.7,
                          within(bits[1], low.z, high.z));
    }
    return places;
  }

  AuralizerInput input;
  std::vector<PreparedSignal> signals;
  RadiationModel radiation;
  SignalWeights weights;
};

// New random numbers u, like those of a bake with another seed.
inline std::vector<float> rolled_u(std::uint64_t roll, std::size_t sources) {
  std::vector<float> u(sources + 3);
  for (std::size_t i = 0; i < sources; i += 4) {
    const RandomBits bits = philox(roll, {static_cast<std::uint32_t>(i), 0, 0, 0});
    for (std::size_t j = 0; j < 4; ++j) u[i + j] = static_cast<float>(unit_above_zero(bits[j]));
  }
  return u;
}

}  // namespace clamor::testing
