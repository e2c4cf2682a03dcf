#include "runtime/propagation/received_intensity.h"

#include <bit>
#include <cmath>
#include <cstdint>
#include <numbers>

#include "common/directivity.h"

namespace clamor {

namespace {

// exp(-x) for x >= 0, with an error below 3e-7 for x < 1 and a result of at least 2e-38. The loop
// vectorises, and gives the same bits on all machines, unlike std::exp.
Bands exp_of_negative(const Bands& x) {
  Bands result;
  for (std::size_t b = 0; b < kBandCount; ++b) {
    // 2^-y with y = whole + part; 2^-part by its Taylor series up to the 7th power.
    const float y = std::min(x[b] * std::numbers::log2e_v<float>, 125.0f);
    const auto whole = static_cast<std::int32_t>(y + 0.5f);
    const float z = (static_cast<float>(whole) - y) * std::numbers::ln2_v<float>;
    const float part =
        1 +
        z * (1 + z * (1 / 2.f +
                      z * (1 / 6.f +
                           z * (1 / 24.f + z * (1 / 120.f + z * (1 / 720.f + z * (1 / 5040.f)))))));
    result[b] = part * std::bit_cast<float>((127 - whole) << 23);
  }
  return result;
}

}  // namespace

Bands air_transmittance(const Bands& loss_per_m, double r_m) {
  const auto r = static_cast<float>(r_m);
  Bands loss;
  for (std::size_t b = 0; b < kBandCount; ++b) loss[b] = loss_per_m[b] * r;
  return exp_of_negative(loss);
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
