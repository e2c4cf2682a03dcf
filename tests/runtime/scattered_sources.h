// scattered_sources.h: scattered emitters and reflections, with materials from Lambertian to
// mirror-like.
#pragma once

#include <cmath>
#include <cstdint>
#include <vector>

#include "common/material.h"
#include "common/random.h"
#include "common/vec.h"
#include "formats/bake_file/source.h"
#include "formats/level/emitter.h"
#include "runtime/propagation/radiation_model.h"
#include "runtime/propagation/source_bound.h"

namespace clamor::testing {

inline Vec3 direction(const RandomBits& bits) {
  return glm::normalize(Vec3(unit(bits[0]), unit(bits[1]), unit(bits[2])) - 0.4999);
}

// Scattered within `spread_m` around `middle_m`.
struct ScatteredSources {
  ScatteredSources(std::uint64_t seed, std::uint32_t count, double spread_m, const Vec3& middle_m) {
    for (const float exponent : {0.0f, 3.0f, 20.0f, 100.0f, 1000.0f}) {
      Material& material = materials.emplace_back();
      material.scattering = same_in_all_bands(exponent > 3 ? 0.0f : 0.3f);
      material.phong = same_in_all_bands(exponent);
      material.phong[3] = exponent / 2;  // so that bands differ
      Emitter& emitter = emitters.emplace_back();
      emitter.directivity = same_in_all_bands(exponent);
      emitter.directivity[5] = exponent / 3;
    }
    for (std::uint32_t i = 0; i < count; ++i) {
      const RandomBits a = philox(seed, {i, 0, 0, 0}), b = philox(seed, {i, 1, 0, 0}),
                       c = philox(seed, {i, 2, 0, 0}), d = philox(seed, {i, 3, 0, 0});
      Source& source = sources.emplace_back();
      source.position_m =
          Vec3f(middle_m + spread_m * (Vec3(unit(a[0]), unit(a[1]), unit(a[2])) - 0.5));
      source.normal = Vec3f(direction(b));
      source.mirror = Vec3f(direction(c));
      if (dot(source.normal, source.mirror) < 0) source.mirror = -source.mirror;
      for (std::size_t band = 0; band < kBandCount; ++band)
        source.power[band] = static_cast<float>(std::pow(10, -4 * unit(d[0]) - 0.1 * band));
      source.patch_radius_m = static_cast<float>(unit(d[1]));
      source.u = static_cast<float>(unit_above_zero(d[2]));
      source.emitter = d[3] % 5;
      source.material = static_cast<std::uint16_t>(d[3] / 8 % 5);
      source.is_emitter = d[3] / 64 % 6 == 0;
      if (source.is_emitter) source.mirror = source.normal;
      source.is_image = source.is_emitter && d[3] / 512 % 2 == 0;
      if (source.is_image) source.original_m = Vec3f(middle_m + spread_m * direction(c));
    }
  }

  std::vector<SourceBound> bounds(const RadiationModel& radiation) const {
    std::vector<SourceBound> bounds;
    for (const Source& source : sources)
      bounds.push_back(source_bound(radiation, source, radiation.upper_bound(source, weight)));
    return bounds;
  }

  std::vector<Material> materials;
  std::vector<Emitter> emitters;
  std::vector<Source> sources;
  Bands weight = {1, 2, 3, 4, 5, 4, 3, 2};
};

}  // namespace clamor::testing
