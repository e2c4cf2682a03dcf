#include "runtime/received_intensity.h"

#include <algorithm>
#include <cassert>
#include <cmath>

#include "common/directivity.h"

namespace clamor {

Vec3 source_position_m(const Source& source, const std::vector<Emitter>& emitters) {
  assert(source.emitter < emitters.size());
  return source.is_emitter ? emitters[source.emitter].position_m : Vec3(source.position_m);
}

Bands received_intensity(const Source& source, const std::vector<Emitter>& emitters,
                         const ReflectionLaws& laws, const Bands& air_loss_per_m,
                         const Vec3& receiver_m) {
  const Vec3 path_m = receiver_m - source_position_m(source, emitters);
  const double r_m = length(path_m);

  Bands intensity{};
  double nearest_m = 0;
  if (source.is_emitter) {
    const Emitter& emitter = emitters[source.emitter];
    const double cos_a = r_m > 0 ? std::clamp(dot(path_m, emitter.axis) / r_m, -1.0, 1.0) : 1;
    for (std::size_t b = 0; b < kBandCount; ++b)
      intensity[b] =
          static_cast<float>(emitter.gain * emitter.gain * emission(emitter.directivity[b], cos_a));
    nearest_m = kEmitterRadius_m;
  } else {
    const Vec3 normal(source.normal), mirror(source.mirror);
    const Vec3 direction = r_m > 0 ? path_m / r_m : normal;
    intensity = laws.density(source.material, dot(mirror, normal), dot(direction, normal),
                             dot(direction, mirror));
    for (std::size_t b = 0; b < kBandCount; ++b) intensity[b] *= source.power[b];
    nearest_m = std::max<double>(source.patch_radius_m, 1e-3);  // never a division by zero
  }

  const double spread = 1 / std::pow(std::max(r_m, nearest_m), 2);
  for (std::size_t b = 0; b < kBandCount; ++b)
    intensity[b] *= static_cast<float>(spread * std::exp(-air_loss_per_m[b] * r_m));
  return intensity;
}

}  // namespace clamor
