// trace_surface-inl.h: first part of a bounce: air attenuation, absorption, deposits and roulette.
//
// Compiled once per instruction set, by bake/trace/trace_kernel.cpp.
#if defined(CLAMOR_BAKE_TRACE_SURFACE_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef CLAMOR_BAKE_TRACE_SURFACE_INL_H_
#undef CLAMOR_BAKE_TRACE_SURFACE_INL_H_
#else
#define CLAMOR_BAKE_TRACE_SURFACE_INL_H_
#endif

#include <cmath>

#include <hwy/highway.h>

#include "bake/trace/trace_vectors-inl.h"

HWY_BEFORE_NAMESPACE();
namespace clamor {
namespace HWY_NAMESPACE {
namespace {

// Applies air and surface to each photon's bands and tallies photons that leave the level or exceed
// the longest path. Returns the number of hits.
[[gnu::noinline]] std::size_t meet(const ShadeArguments& with) {
  const auto photons = with.photons;
  const auto hits = with.hits;
  const auto runs = with.runs;
  const auto slots = with.alive;
  const auto materials = with.materials;
  ShadeScratch& scratch = with.scratch;
  const BandVector air = load(with.settings.air_log2_loss_per_m);
  std::size_t count = 0;
  for (std::size_t i = 0; i < with.alive.size(); ++i) {
    KernelPhoton& photon = photons[slots[i]];
    const SurfaceHit& hit = hits[i];
    TraceTally& tally = runs[photon.run].tally;
    std::array<double, kBandCount>* lost = nullptr;
    if (hit.material == SurfaceHit::kNone) {
      ++tally.escaped;
      lost = &tally.power_escaped;
    } else {
      photon.travelled_m += static_cast<double>(hit.distance_m);
      if (photon.travelled_m > with.settings.longest_m || with.bounce > with.settings.max_bounces)
        lost = &tally.power_unfinished;
    }
    if (lost != nullptr) {
      for (std::size_t b = 0; b < kBandCount; ++b)
        (*lost)[b] += static_cast<double>(photon.power[b]) * static_cast<double>(photon.weight[b]);
      continue;
    }
    ++tally.bounces;
    if (with.bounce > 1) {
      tally.legs_m += static_cast<double>(hit.distance_m);
      ++tally.legs;
    }
    const KernelMaterial& material = materials[hit.material];
    const BandVector power = load(photon.power), weight = load(photon.weight);
    const BandVector left = power * exp2_of_bands(air * -hit.distance_m) * load(material.kept);
    const BandVector after = left * weight;
    store(left, photon.power);
    store(after, scratch.left[count]);
    scratch.before[count] = greatest_of(power * weight);
    scratch.after[count] = greatest_of(after);
    scratch.reflected[count] = sum_of(after * load(material.reflected_of_kept));
    scratch.slot[count] = slots[i];
    scratch.hit[count] = static_cast<std::uint32_t>(i);
    scratch.key[0][count] = static_cast<std::uint32_t>(photon.key);
    scratch.key[1][count] = static_cast<std::uint32_t>(photon.key >> 32);
    scratch.number[0][count] = static_cast<std::uint32_t>(photon.number);
    scratch.number[1][count] = static_cast<std::uint32_t>(photon.number >> 32);
    ++count;
  }
  return count;
}

// Computes survival probabilities and random numbers. The upper 24 bits of the four words are the
// deposit's random number, roulette, the band that samples and the choice of Lambert; the low bytes
// of the last three decide whether a weak deposit is kept.
[[gnu::noinline]] void decide(const ShadeArguments& with, std::size_t count) {
  ShadeScratch& scratch = with.scratch;
  draw(scratch, count, with.bounce, Use::kPolarity, scratch.fate);
  const float kappa = with.settings.kappa;
  for (std::size_t j = 0; j < count; ++j) {
    const float after = scratch.after[j] > 1e-37f ? scratch.after[j] : 1e-37f;
    const float before = scratch.before[j] > 1e-37f ? scratch.before[j] : 1e-37f;
    const float ratio = after < before ? after / before : 1.0f;
    scratch.survival[j] = exp2_of(kappa * log2_of(ratio));
    scratch.u[j] =
        static_cast<float>(static_cast<std::int32_t>(scratch.fate.words[0][j] >> 8) + 1) * 0x1p-24f;
    scratch.roulette[j] = unit_of(scratch.fate.words[1][j]);
    scratch.keep[j] =
        unit_of((scratch.fate.words[1][j] << 24) | (scratch.fate.words[2][j] & 255) << 16 |
                (scratch.fate.words[3][j] & 255) << 8);
  }
}

CLAMOR_INLINE void put_deposit(const ShadeArguments& with, const KernelPhoton& photon,
                               std::uint32_t hit_index, BandVector power, float u, bool positive,
                               bool through) {
  const KernelRun& run = with.runs[photon.run];
  const SurfaceHit& hit = with.hits[hit_index];
  const Ray& ray = with.rays[hit_index];
  const Vec3f point_m = ray.origin_m + ray.direction * hit.distance_m;
  Source& deposit = with.sink.deposits[with.sink.count];
  deposit.position_m = point_m;
  deposit.normal = through ? -hit.normal : hit.normal;
  deposit.mirror = through ? ray.direction : ray.direction + hit.normal * (2 * hit.cos_i);
  deposit.delay_s = static_cast<float>(photon.travelled_m * with.settings.seconds_per_m);
  store(power, deposit.power);
  deposit.patch_radius_m = 0;
  deposit.u = u;
  deposit.emitter = run.emitter;
  deposit.material = static_cast<std::uint16_t>(hit.material);
  deposit.polarity = positive ? 1 : -1;
  deposit.is_emitter = false;
  with.sink.runs[with.sink.count] = photon.run;
  with.sink.photons[with.sink.count] = photon.index;
  ++with.sink.count;
}

// Thinning of weak deposits: certain to be kept from `threshold` on, below it with probability
// (power / threshold)^(1/4). Returns the factor for the deposit's power, 0 if it is dropped.
CLAMOR_INLINE float kept_scale(float power, float least, float draw) {
  if (!(power > 0)) return 0;
  if (power >= least) return 1;
  const float odds = std::sqrt(std::sqrt(power / least));
  return draw < odds ? 1 / odds : 0;
}

// Writes deposits and applies roulette. Returns the number of survivors.
[[gnu::noinline]] std::size_t deposit_and_survive(const ShadeArguments& with, std::size_t count) {
  const auto photons = with.photons;
  const auto hits = with.hits;
  const auto materials = with.materials;
  const auto runs = with.runs;
  ShadeScratch& scratch = with.scratch;
  std::size_t going = 0;
  for (std::size_t j = 0; j < count; ++j) {
    if (!(scratch.after[j] > 0)) continue;
    KernelPhoton& photon = photons[scratch.slot[j]];
    const SurfaceHit& hit = hits[scratch.hit[j]];
    const KernelMaterial& material = materials[hit.material];
    const float least = runs[photon.run].deposit_threshold;
    const float scale = kept_scale(scratch.reflected[j], least, scratch.keep[j]);
    const bool positive = (scratch.fate.words[0][j] & 1) != 0;
    const BandVector left = load(scratch.left[j]);
    if (scale > 0)
      put_deposit(with, photon, scratch.hit[j], left * load(material.reflected_of_kept) * scale,
                  scratch.u[j], positive, false);
    if (material.transmits) {
      const BandVector part = left * load(material.through_of_kept);
      const RandomBits bits =
          philox(photon.key, {static_cast<std::uint32_t>(photon.number),
                              static_cast<std::uint32_t>(photon.number >> 32), with.bounce,
                              static_cast<std::uint32_t>(Use::kTransmission)});
      const float through_scale = kept_scale(sum_of(part), least, unit_of(bits[2]));
      if (through_scale > 0)
        put_deposit(with, photon, scratch.hit[j], part * through_scale,
                    static_cast<float>((bits[0] >> 8) + 1) * 0x1p-24f, (bits[1] & 1) != 0, true);
    }

    if (scratch.roulette[j] >= scratch.survival[j]) continue;
    store(load(photon.power) * (1 / scratch.survival[j]), photon.power);
    scratch.going_slot[going] = scratch.slot[j];
    scratch.going_hit[going] = scratch.hit[j];
    // From here on, the columns of random number keys hold the survivors only.
    scratch.key[0][going] = scratch.key[0][j];
    scratch.key[1][going] = scratch.key[1][j];
    scratch.number[0][going] = scratch.number[0][j];
    scratch.number[1][going] = scratch.number[1][j];
    scratch.band_bits[going] = scratch.fate.words[2][j];
    scratch.lambert_bits[going] = scratch.fate.words[3][j];
    ++going;
  }
  return going;
}

}  // namespace
}  // namespace HWY_NAMESPACE
}  // namespace clamor
HWY_AFTER_NAMESPACE();

#endif  // CLAMOR_BAKE_TRACE_SURFACE_INL_H_
