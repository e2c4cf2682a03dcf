// baked_level.h: the level of a bake file, to be baked again with other materials or settings.
#pragma once

#include <cstdint>
#include <memory>
#include <string>

#include "formats/bake_file/bake_metadata.h"
#include "formats/level/level.h"
#include "tools/experiments/experiment_scene.h"

namespace clamor {

struct BakedLevel {
  Level level;
  BakeSettings settings;

  static Result<BakedLevel> open(const std::string& path);

  // Gives all surfaces Phong lobes of these exponents without scattering; 0 is diffuse.
  void set_phong(const Bands& exponents);

  // Bakes with about that many secondary sources, without image sources: the paper's experiments
  // have no occlusion. Deterministic.
  Result<std::unique_ptr<ExperimentScene>> rebake(std::uint64_t sources) const;
};

}  // namespace clamor
