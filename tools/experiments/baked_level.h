// baked_level.h: the level of a bake file, to be baked again with other materials or settings.
#pragma once

#include <cstdint>
#include <memory>
#include <string>

#include "formats/bake_file/bake_metadata.h"
#include "formats/level/level.h"
#include "tools/experiments/experiment_scene.h"

namespace clamor {

class BakedLevel {
 public:
  static Result<BakedLevel> open(const std::string& path);

  const Level& level() const { return level_; }
  const BakeSettings& settings() const { return settings_; }

  // Gives all surfaces Phong lobes of these exponents without scattering; 0 is diffuse.
  void set_phong(const Bands& exponents);

  // Makes all emitters play a single impulse.
  void set_impulse();

  // Bakes with about that many secondary sources, without image sources: the paper's experiments
  // have no occlusion. Deterministic.
  Result<std::unique_ptr<ExperimentScene>> rebake(std::uint64_t sources) const;

 private:
  Level level_;
  BakeSettings settings_;
};

}  // namespace clamor
