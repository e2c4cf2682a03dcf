// baked_level.h: the level of a bake file, to be baked again with other materials or settings.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "formats/bake_file/bake_contents.h"
#include "formats/bake_file/bake_metadata.h"
#include "formats/level/level.h"
#include "runtime/occlusion/occlusion_geometry.h"
#include "runtime/response/energy_response.h"
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

// A level, baked to be measured: the energies that arrive at a place.
class BakedEnergies {
 public:
  // Fails as bake() does. The air of the settings is that of the responses, too.
  static Result<BakedEnergies> bake_level(const Level& level, const BakeSettings& settings);

  // All arrivals of an emitter's impulse: its direct sound, its secondary and its image sources,
  // behind the level's surfaces.
  std::vector<Arrival> at(const Vec3& place_m, std::uint32_t emitter) const;

 private:
  BakeContents contents_;
  std::vector<Source> sources_;  // with images
  std::unique_ptr<const OcclusionGeometry> surfaces_;
};

}  // namespace clamor
