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

// Records a power that leaves no deposit.
void record_power(const ShadeArguments& with, const KernelPhoton& photon, PathTally::Kind kind,
                  BandVector power) {
  PathTally& tally = with.sink.tallies->emplace_back();
  tally.kind = kind;
  tally.run = photon.run;
  tally.node = photon.node;
  store(power, tally.power);
}

// Share of the power that ends between one hit and the next because the longest path is near: all
// beyond it, and in the fade before it as much as lets the rest fall to 0 linearly.
CLAMOR_INLINE float share_ending(const KernelSettings& settings, double from_m, double to_m) {
  if (!(to_m < settings.max_path_m)) return 1;
  const double begin_m = settings.max_path_m - settings.fade_m;
  if (!(to_m > begin_m)) return 0;
  from_m = from_m > begin_m ? from_m : begin_m;
  return static_cast<float>((to_m - from_m) / (settings.max_path_m - from_m));
}

// Applies air and surface to each photon's bands and tallies photons that leave the level or exceed
// the longest path. Returns the number of hits.
[[gnu::noinline]] std::size_t attenuate(const ShadeArguments& with) {
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
    auto kind = PathTally::Kind::kUnfinished;
    float ending = 1;  // share of the power
    if (hit.material == SurfaceHit::kNone) {
      tally.escaped += photon.is_copy ? 0 : 1;
      lost = &tally.power_escaped;
      kind = PathTally::Kind::kEscaped;
    } else {
      const double from_m = photon.travelled_m;
      photon.travelled_m += static_cast<double>(hit.distance_m);
      if (with.bounce <= with.settings.max_bounces)
        ending = share_ending(with.settings, from_m, photon.travelled_m);
      if (ending > 0) lost = &tally.power_unfinished;
    }
    if (lost != nullptr) {
      for (std::size_t b = 0; b < kBandCount; ++b)
        (*lost)[b] += static_cast<double>(photon.power[b]) * static_cast<double>(photon.weight[b]) *
                      static_cast<double>(ending);
      if (with.sink.tallies != nullptr)
        record_power(with, photon, kind, load(photon.power) * load(photon.weight) * ending);
      if (!(ending < 1)) continue;
    }
    ++tally.bounces;
    if (with.bounce > 1) {
      tally.legs_m += static_cast<double>(hit.distance_m);
      ++tally.legs;
    }
    const KernelMaterial& material = materials[hit.material];
    const BandVector power = load(photon.power), weight = load(photon.weight);
    const BandVector through_air = power * exp2_of(air * -hit.distance_m);
    const BandVector left =
        through_air * load(material.reflectance_plus_transmittance) * (1 - ending);
    const BandVector after = left * weight;
    if (auto* const arrived = runs[photon.run].arrived; arrived != nullptr) {
      const BandVector arriving = through_air * weight * (1 - ending);
      for (int b = 0; b < static_cast<int>(kBandCount); ++b)
        arrived[hit.material][static_cast<std::size_t>(b)] += static_cast<double>(arriving[b]);
    }
    store(left, photon.power);
    store(after, scratch.left[count]);
    scratch.before[count] = max_of(power * weight);
    scratch.after[count] = max_of(after);
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
[[gnu::noinline]] void draw_decisions(const ShadeArguments& with, std::size_t count) {
  ShadeScratch& scratch = with.scratch;
  draw(scratch, count, with.bounce, Use::kPolarity, scratch.surface_bits);
  const float exponent = with.settings.roulette_exponent;
  for (std::size_t j = 0; j < count; ++j) {
    const float after = scratch.after[j] > 1e-37f ? scratch.after[j] : 1e-37f;
    const float before = scratch.before[j] > 1e-37f ? scratch.before[j] : 1e-37f;
    const float ratio = after < before ? after / before : 1.0f;
    scratch.survival[j] = exp2_of(exponent * log2_of(ratio));
    scratch.random[j] =
        static_cast<float>(static_cast<std::int32_t>(scratch.surface_bits.words[0][j] >> 8) + 1) *
        0x1p-24f;
    scratch.roulette[j] = unit_of(scratch.surface_bits.words[1][j]);
    scratch.keep[j] = unit_of((scratch.surface_bits.words[1][j] << 24) |
                              (scratch.surface_bits.words[2][j] & 255) << 16 |
                              (scratch.surface_bits.words[3][j] & 255) << 8);
  }
}

// Whether an image source stands for what a mirror reflects of the photon.
bool is_of_image(const ShadeArguments& with, const KernelPhoton& photon, const SurfaceHit& hit,
                 const Ray& ray) {
  if (with.settings.images == nullptr || !photon.is_specular || with.bounce > kMaxImageOrder)
    return false;
  const Vec3 leaving = mirrored(Vec3(ray.direction), Vec3(hit.normal));
  const Vec3 point_m =
      Vec3(ray.origin_m) + Vec3(ray.direction) * static_cast<double>(hit.distance_m);
  return with.settings.images->contains(with.runs[photon.run].emitter,
                                        point_m - leaving * photon.travelled_m, photon.travelled_m);
}

CLAMOR_INLINE void write_deposit(const ShadeArguments& with, const KernelPhoton& photon,
                                 std::uint32_t hit_index, std::uint32_t material, BandVector power,
                                 float random, bool transmitted) {
  const KernelRun& run = with.runs[photon.run];
  const SurfaceHit& hit = with.hits[hit_index];
  const Ray& ray = with.rays[hit_index];
  const Vec3f point_m = ray.origin_m + ray.direction * hit.distance_m;
  Deposit& deposit = with.sink.deposits[with.sink.count];
  deposit.position_m = point_m;
  deposit.normal = transmitted ? -hit.normal : hit.normal;
  deposit.mirror = transmitted ? ray.direction : ray.direction + hit.normal * (2 * hit.cos_i);
  deposit.delay_s = static_cast<float>(photon.travelled_m * with.settings.seconds_per_m);
  store(power, deposit.power);
  deposit.random = random;
  deposit.material = static_cast<std::uint16_t>(material);
  deposit.photon = photon.index;
  deposit.emitter = run.emitter;
  deposit.portals = photon.portals;
  with.sink.runs[with.sink.count] = photon.run;
  if (with.sink.nodes != nullptr) with.sink.nodes[with.sink.count] = photon.node;
  ++with.sink.count;
}

// The weight of a deposit, as DepositWeight::of().
CLAMOR_INLINE float weight_of(const DepositWeight& weight, BandVector power, float path_m) {
  const BandVector knee_m = load(weight.knee_m()), path = BandVector{} + path_m;
  const BandVector before_m = path < knee_m ? path : knee_m;
  const BandVector lost = before_m * load(weight.early_log2_loss_per_m()) +
                          (path - before_m) * load(weight.late_log2_loss_per_m());
  const BandVector most = BandVector{} + DepositWeight::kMostLost_log2;
  const BandVector lost_log2 = lost < most ? lost : most;
  return sum_of(power * exp2_of(lost_log2)) *
         sum_of(exp2_of(lost_log2 * -DepositWeight::kShareExponent)) / kBandCount;
}

// Thinning of weak deposits: certain to be kept from the threshold on, below it with probability
// (weight / threshold)^(3/4). Returns the factor for the deposit's power, 0 if it is dropped.
CLAMOR_INLINE float thinning_factor(const DepositWeight& weight, const KernelRun& run,
                                    const KernelPhoton& photon, BandVector power, float draw) {
  if (!(max_of(power) > 0) || !(photon.deposit_times > 0)) return 0;
  if (photon.travelled_m < run.early_until_m) return run.deposits_early ? 1 : 0;
  if (!(run.deposit_threshold > 0)) return 1;
  const float ratio = photon.deposit_times *
                      weight_of(weight, power, static_cast<float>(photon.travelled_m)) /
                      run.deposit_threshold;
  if (ratio >= 1) return 1;
  const float odds = odds_of(ratio);
  return draw < odds ? 1 / odds : 0;
}

// Writes deposits and applies roulette. Returns the number of survivors.
[[gnu::noinline]] std::size_t deposit_and_survive(const ShadeArguments& with, std::size_t count) {
  const auto photons = with.photons;
  const auto hits = with.hits;
  const auto materials = with.materials;
  const auto runs = with.runs;
  ShadeScratch& scratch = with.scratch;
  std::size_t survivors = 0;
  for (std::size_t j = 0; j < count; ++j) {
    if (!(scratch.after[j] > 0)) continue;
    KernelPhoton& photon = photons[scratch.slot[j]];
    const SurfaceHit& hit = hits[scratch.hit[j]];
    const KernelMaterial& material = materials[hit.material];
    const KernelRun& run = runs[photon.run];
    const float times = photon.deposit_times;
    const BandVector left = load(scratch.left[j]);
    BandVector reflected = left * load(material.reflected_fraction);
    std::uint32_t deposited_as = hit.material;
    if (material.is_mirror && is_of_image(with, photon, hit, with.rays[scratch.hit[j]])) {
      const BandVector scattered = reflected * load(material.brdf.scattering);
      Bands of_image;
      store(reflected - scattered, of_image);
      for (std::size_t b = 0; b < kBandCount; ++b)
        runs[photon.run].tally.power_of_images[b] += static_cast<double>(of_image[b]);
      if (with.sink.tallies != nullptr)
        record_power(with, photon, PathTally::Kind::kOfImage, load(of_image));
      reflected = scattered;
      deposited_as = material.scattered_share;
    }
    const DepositWeight& weight = with.settings.deposit_weight;
    const float scale = times * thinning_factor(weight, run, photon, reflected, scratch.keep[j]);
    if (scale > 0)
      write_deposit(with, photon, scratch.hit[j], deposited_as, reflected * scale,
                    scratch.random[j], false);
    if (material.transmits) {
      const BandVector part = left * load(material.transmitted_fraction);
      const RandomBits bits =
          philox(photon.key, {static_cast<std::uint32_t>(photon.number),
                              static_cast<std::uint32_t>(photon.number >> 32), with.bounce,
                              static_cast<std::uint32_t>(Use::kTransmission)});
      const float transmitted_scale =
          times * thinning_factor(weight, run, photon, part, unit_of(bits[2]));
      if (transmitted_scale > 0)
        write_deposit(with, photon, scratch.hit[j], hit.material, part * transmitted_scale,
                      static_cast<float>((bits[0] >> 8) + 1) * 0x1p-24f, true);
    }

    if (scratch.roulette[j] >= scratch.survival[j]) continue;
    store(load(photon.power) * (1 / scratch.survival[j]), photon.power);
    scratch.survivor_slot[survivors] = scratch.slot[j];
    scratch.survivor_hit[survivors] = scratch.hit[j];
    // From here on, the columns of random number keys hold the survivors only.
    scratch.key[0][survivors] = scratch.key[0][j];
    scratch.key[1][survivors] = scratch.key[1][j];
    scratch.number[0][survivors] = scratch.number[0][j];
    scratch.number[1][survivors] = scratch.number[1][j];
    scratch.band_bits[survivors] = scratch.surface_bits.words[2][j];
    scratch.lambert_bits[survivors] = scratch.surface_bits.words[3][j];
    ++survivors;
  }
  return survivors;
}

}  // namespace
}  // namespace HWY_NAMESPACE
}  // namespace clamor
HWY_AFTER_NAMESPACE();

#endif  // CLAMOR_BAKE_TRACE_SURFACE_INL_H_
