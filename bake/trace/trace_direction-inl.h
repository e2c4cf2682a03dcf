// trace_direction-inl.h: second part of a bounce: samples the next direction from one band's BRDF
// and reweights all bands.
//
// Compiled once per instruction set, by bake/trace/trace_kernel.cpp.
#if defined(CLAMOR_BAKE_TRACE_DIRECTION_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef CLAMOR_BAKE_TRACE_DIRECTION_INL_H_
#undef CLAMOR_BAKE_TRACE_DIRECTION_INL_H_
#else
#define CLAMOR_BAKE_TRACE_DIRECTION_INL_H_
#endif

#include <cmath>

#include <hwy/highway.h>

#include "bake/trace/trace_vectors-inl.h"
#include "common/reflection_law-inl.h"

HWY_BEFORE_NAMESPACE();
namespace clamor {
namespace HWY_NAMESPACE {
namespace {

// Chooses the band whose BRDF samples the direction, and reflection or transmission. The upper 24
// bits of the random words are two coordinates of the direction, its acceptance and the
// compensation term; the low bytes choose the side.
[[gnu::noinline]] void choose_bands(const ShadeArguments& with, std::size_t count) {
  const auto photons = with.photons;
  const auto hits = with.hits;
  const auto materials = with.materials;
  const auto rays = with.rays;
  ShadeScratch& scratch = with.scratch;
  for (std::size_t k = 0; k < count; ++k) {
    const KernelPhoton& photon = photons[scratch.survivor_slot[k]];
    const SurfaceHit& hit = hits[scratch.survivor_hit[k]];
    const KernelMaterial& material = materials[hit.material];
    std::size_t drawn = 0;
    if (!material.same_in_all_bands || material.transmits) {
      const float place = unit_of(scratch.band_bits[k]) * kBandCount;
      float below = 0;
      for (std::size_t b = 0; b + 1 < kBandCount; ++b) {
        below += photon.weight[b];
        drawn += place >= below ? 1 : 0;
      }
    }
    scratch.drawn[k] = static_cast<std::uint8_t>(drawn);
    const bool transmitted =
        material.transmits && unit_of(scratch.direction_bits.words[0][k] << 24 |
                                      (scratch.direction_bits.words[1][k] & 255) << 16 |
                                      (scratch.direction_bits.words[2][k] & 255) << 8) <
                                  material.transmitted_fraction[drawn];
    const Vec3f normal = transmitted ? -hit.normal : hit.normal;
    const Vec3f arrival = rays[scratch.survivor_hit[k]].direction;
    const Vec3f mirror = transmitted ? arrival : arrival + hit.normal * (2 * hit.cos_i);
    for (int axis = 0; axis < 3; ++axis) {
      scratch.normal[axis][k] = normal[axis];
      scratch.mirror[axis][k] = mirror[axis];
    }
    scratch.transmitted[k] = transmitted ? 1 : 0;
    scratch.cos_i[k] = hit.cos_i;
    scratch.scattering[k] = material.brdf.scattering[drawn];
    scratch.inverse_exponent[k] = material.inverse_exponent[drawn];
    const bool first = with.bounce == 1;
    scratch.u1[k] = first ? photon.first_bounce[0] : unit_of(scratch.direction_bits.words[0][k]);
    scratch.u2[k] = first ? photon.first_bounce[1] : unit_of(scratch.direction_bits.words[1][k]);
  }
}

// The direction at angle a (given its cosine) to a unit axis, rotated around it by `turn`
// revolutions. The basis is Duff's, as in common/vec.h.
CLAMOR_INLINE Vec3f around(float x, float y, float z, float cos_a, float turn) {
  const float sign = z < 0 ? -1.0f : 1.0f;
  const float a = -1 / (sign + z);
  const float b = x * y * a;
  const float square = (1 - cos_a) * (1 + cos_a);
  const float sin_a = std::sqrt(square > 0 ? square : 0.0f);
  const SinCos s = sin_cos_of_turn(turn);
  const float p = sin_a * s.cos, q = sin_a * s.sin;
  return {x * cos_a + (1 + sign * x * x * a) * p + b * q,
          y * cos_a + sign * b * p + (sign + y * y * a) * q, z * cos_a - sign * x * p - y * q};
}

// Samples Lambert's law or the lobe around the mirror direction.
[[gnu::noinline]] void sample_proposals(ShadeScratch& scratch, std::size_t count) {
  for (std::size_t k = 0; k < count; ++k) {
    const bool lambert = unit_of(scratch.lambert_bits[k]) < scratch.scattering[k];
    const float left = 1 - scratch.u1[k];
    const float cos_lambert = std::sqrt(left);
    const float cos_lobe = draw_lobe_cos(left, scratch.inverse_exponent[k]);
    const float nx = scratch.normal[0][k], ny = scratch.normal[1][k], nz = scratch.normal[2][k];
    const float mx = scratch.mirror[0][k], my = scratch.mirror[1][k], mz = scratch.mirror[2][k];
    const Vec3f direction = around(lambert ? nx : mx, lambert ? ny : my, lambert ? nz : mz,
                                   lambert ? cos_lambert : cos_lobe, scratch.u2[k]);
    const float cos_o = direction.x * nx + direction.y * ny + direction.z * nz;
    const float u3 = unit_of(scratch.direction_bits.words[2][k]);
    scratch.direction[0][k] = direction.x;
    scratch.direction[1][k] = direction.y;
    scratch.direction[2][k] = direction.z;
    const bool is_mirror = !(scratch.inverse_exponent[k] > 0);
    const bool accepted = lambert || is_mirror || accepts_lobe(scratch.cos_i[k], cos_o, u3);
    scratch.rejected[k] = accepted ? 0 : 1;
    scratch.specular[k] = is_mirror && !lambert ? 1 : 0;
  }
}

// Samples the compensation term for proposals that were rejected or lie below the surface.
[[gnu::noinline]] void sample_compensation(const ShadeArguments& with, std::size_t count) {
  const auto hits = with.hits;
  const auto materials = with.materials;
  ShadeScratch& scratch = with.scratch;
  for (std::size_t k = 0; k < count; ++k) {
    if (scratch.rejected[k] == 0) continue;
    const KernelMaterial& material = materials[hits[scratch.survivor_hit[k]].material];
    const PhongLobe& lobe = *material.lobes[scratch.drawn[k]];
    // 16 bits for the angle, 16 for the rotation.
    const std::uint32_t bits = scratch.direction_bits.words[3][k];
    const float cos_o =
        lobe.draw_compensation_cos(static_cast<float>(bits >> 16) * 0x1p-16f + 0x1p-17f);
    const Vec3f direction = around(scratch.normal[0][k], scratch.normal[1][k], scratch.normal[2][k],
                                   cos_o, static_cast<float>(bits & 0xffff) * 0x1p-16f);
    for (int axis = 0; axis < 3; ++axis) scratch.direction[axis][k] = direction[axis];
  }
}

// Computes the cosines for evaluating the BRDF.
[[gnu::noinline]] void compute_cosines(ShadeScratch& scratch, std::size_t count) {
  for (std::size_t k = 0; k < count; ++k) {
    float x = scratch.direction[0][k], y = scratch.direction[1][k], z = scratch.direction[2][k];
    const float scale = 1 / std::sqrt(x * x + y * y + z * z);
    x *= scale;
    y *= scale;
    z *= scale;
    scratch.direction[0][k] = x;
    scratch.direction[1][k] = y;
    scratch.direction[2][k] = z;
    const float cos_o =
        x * scratch.normal[0][k] + y * scratch.normal[1][k] + z * scratch.normal[2][k];
    float cos_a = x * scratch.mirror[0][k] + y * scratch.mirror[1][k] + z * scratch.mirror[2][k];
    cos_a = cos_a < 1 ? cos_a : 1.0f;
    const float cos_i = scratch.cos_i[k];
    scratch.cos_o[k] = cos_o;
    scratch.log2_cos_a[k] = log2_of_base(cos_a);
    scratch.tilt[k] = tilt_of(cos_i, cos_o);
    constexpr float kCells = ReflectionTable::kCells - 1e-4f;  // below the last row
    scratch.loss_cell_i[k] = loss_cell_of(cos_i, kCells);
    scratch.loss_cell_o[k] = loss_cell_of(cos_o, kCells);
  }
}

// Updates the band weights of each path, w <- 8 w q / sum(w q), and creates its next ray. Returns
// the number of live photons, listed in order.
[[gnu::noinline]] std::size_t update_weights(const ShadeArguments& with, std::size_t count) {
  const auto photons = with.photons;
  const auto hits = with.hits;
  const auto materials = with.materials;
  const auto rays = with.rays;
  const auto slots = with.alive;
  ShadeScratch& scratch = with.scratch;
  std::size_t alive = 0;
  for (std::size_t k = 0; k < count; ++k) {
    KernelPhoton& photon = photons[scratch.survivor_slot[k]];
    const SurfaceHit& hit = hits[scratch.survivor_hit[k]];
    const KernelMaterial& material = materials[hit.material];
    const bool transmitted = scratch.transmitted[k] != 0;
    if (!(scratch.cos_o[k] > 0)) continue;
    const bool specular = scratch.specular[k] != 0;
    photon.is_specular &= specular && !transmitted;
    // Copies of a photon meet the same points, where one of them deposits for all, until something
    // else than a mirror separates them.
    if (!specular) photon.deposit_times = 1;
    if (!material.same_in_all_bands || material.transmits) {
      BandVector q = load(photon.weight);
      if (material.is_mirror) {
        const BandVector scattering = load(material.brdf.scattering);
        q *= specular ? 1 - scattering : scattering;
      } else if (!material.same_in_all_bands) {
        const ReflectionTable& brdf = material.brdf;
        const auto loss_at = [&](float cell) {
          const auto row = static_cast<std::int32_t>(cell);
          const Bands* const from = &brdf.loss[static_cast<std::size_t>(row)];
          return loss_between(load(from[0]), load(from[1]), cell - static_cast<float>(row));
        };
        q *= photon_density(load(brdf.scattering), load(brdf.lobe), load(brdf.compensation),
                            scratch.cos_o[k], scratch.tilt[k],
                            exp2_of(load(brdf.exponent) * scratch.log2_cos_a[k]),
                            loss_at(scratch.loss_cell_i[k]), loss_at(scratch.loss_cell_o[k]));
      }
      if (material.transmits) {
        const BandVector share = load(material.transmitted_fraction);
        q *= transmitted ? share : 1 - share;
      }
      const float sum = sum_of(q);
      if (!(sum > 1e-30f)) continue;
      store(q * (static_cast<float>(kBandCount) / sum), photon.weight);
    }
    const float offset_m = transmitted ? -with.settings.offset_m : with.settings.offset_m;
    const Ray& ray = rays[scratch.survivor_hit[k]];
    const Vec3f origin_m = ray.origin_m + ray.direction * hit.distance_m + hit.normal * offset_m;
    rays[alive] = {origin_m,
                   {scratch.direction[0][k], scratch.direction[1][k], scratch.direction[2][k]}};
    slots[alive++] = scratch.survivor_slot[k];
  }
  return alive;
}

}  // namespace
}  // namespace HWY_NAMESPACE
}  // namespace clamor
HWY_AFTER_NAMESPACE();

#endif  // CLAMOR_BAKE_TRACE_DIRECTION_INL_H_
