#include "runtime/propagation/received_intensity.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "common/directivity.h"
#include "common/maths.h"

namespace clamor {

Bands air_transmittance(const Bands& loss_per_m, double r_m) {
  const auto r_log2e = static_cast<float>(r_m) * std::numbers::log2e_v<float>;
  Bands left;
  for (std::size_t b = 0; b < kBandCount; ++b) left[b] = exp2_of(-loss_per_m[b] * r_log2e);
  return left;
}

Bands received_intensity(const Source& source, const std::vector<Emitter>& emitters,
                         const ReflectionLaws& laws, const Bands& air_loss_per_m,
                         const Vec3& receiver_m) {
  const Vec3 path_m = receiver_m - Vec3(source.position_m);
  const double r_m = length(path_m);

  Bands intensity{};
  if (source.is_emitter) {
    const Emitter& emitter = emitters[source.emitter];
    const double cos_a =
        r_m > 0 ? std::clamp(dot(path_m, Vec3(source.normal)) / r_m, -1.0, 1.0) : 1;
    double share = 0;  // of the emitted power, reused by bands with the same exponent
    for (std::size_t b = 0; b < kBandCount; ++b) {
      const double p = emitter.directivity[b];
      if (b == 0 || emitter.directivity[b] != emitter.directivity[b - 1])
        share = (p == 0 ? 1 : emission(p, cos_a)) / emission_power(p);  // saves the evaluation
      intensity[b] = static_cast<float>(source.power[b] * share);
    }
  } else {
    const Vec3 normal(source.normal), mirror(source.mirror);
    const double cos_o = r_m > 0 ? dot(path_m, normal) / r_m : 1;
    if (cos_o <= 0) return intensity;
    const double cos_a = r_m > 0 ? dot(path_m, mirror) / r_m : dot(normal, mirror);
    intensity = laws.density(source.material, dot(mirror, normal), cos_o, std::min(cos_a, 1.0));
    for (std::size_t b = 0; b < kBandCount; ++b) intensity[b] *= source.power[b];
  }

  const double clamped_m = std::max(r_m, source_radius_m(source));
  const auto spread = static_cast<float>(1 / (clamped_m * clamped_m));
  const Bands left = air_transmittance(air_loss_per_m, r_m);
  for (std::size_t b = 0; b < kBandCount; ++b) intensity[b] *= spread * left[b];
  return intensity;
}

}  // namespace clamor
