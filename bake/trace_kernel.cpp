#include "bake/trace_kernel.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>

#include "common/maths.h"
#include "common/random.h"

// What all instruction sets share; declared before Highway changes the one we compile for.
#ifndef CLAMOR_TRACE_KERNEL_SHARED
#define CLAMOR_TRACE_KERNEL_SHARED

namespace clamor {

constexpr std::size_t kLanes = 16;  // a multiple of every vector's

// Arrays over the photons of a step, so that lanes can run along them.
template <class T>
using Column = std::array<T, kStepPhotons>;
using VectorColumn = std::array<Column<float>, 3>;

struct RandomColumns {
  std::array<Column<std::uint32_t>, 4> words;
};

struct alignas(64) ShadeScratch {
  // Of those that hit something.
  Column<std::uint16_t> slot;
  Column<std::uint32_t> hit;  // index into the hits
  std::array<Column<std::uint32_t>, 2> key, number;
  RandomColumns fate;
  alignas(64) std::array<Bands, kStepPhotons> left;  // power after the surface, of this path
  Column<float> before, after, reflected, survival;
  Column<float> u, roulette, keep;

  // Of those that go on.
  Column<std::uint16_t> going_slot;
  Column<std::uint32_t> going_hit;
  Column<std::uint8_t> drawn;  // band
  RandomColumns first, second;
  VectorColumn normal, mirror, direction;
  Column<float> u1, u2, cos_i, cos_o, log2_cos_a, ratio, loss_place_i, loss_place_o;
  Column<float> scattering, inverse_exponent;
  Column<std::uint8_t> through, rejected;
};

struct ShadeArguments {
  const KernelSettings& settings;
  std::span<const KernelMaterial> materials;
  std::uint32_t bounce;
  std::span<KernelPhoton> photons;
  std::span<std::uint16_t> alive;
  std::span<const SurfaceHit> hits;
  std::span<KernelRun> runs;
  ShadeScratch& scratch;
  DepositSink& sink;
};

}  // namespace clamor

#endif  // CLAMOR_TRACE_KERNEL_SHARED

// Highway compiles what follows once per instruction set.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "bake/trace_kernel.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace clamor {
namespace HWY_NAMESPACE {
namespace {

// The sum and the greatest of eight, in one order on every machine.
CLAMOR_INLINE float sum_of(const float* x) {
  return ((x[0] + x[4]) + (x[2] + x[6])) + ((x[1] + x[5]) + (x[3] + x[7]));
}
CLAMOR_INLINE float larger(float a, float b) { return a > b ? a : b; }
CLAMOR_INLINE float greatest_of(const float* x) {
  return larger(larger(larger(x[0], x[4]), larger(x[2], x[6])),
                larger(larger(x[1], x[5]), larger(x[3], x[7])));
}

// In [0, 1), 24 bits fine.
CLAMOR_INLINE float unit_of(std::uint32_t bits) {
  return static_cast<float>(static_cast<std::int32_t>(bits >> 8)) * 0x1p-24f;
}

// Philox, as common/random.h has it, of the first `count` keys and numbers, rounded up to kLanes.
void draw(const ShadeScratch& scratch, std::size_t count, std::uint32_t bounce, Use use,
          RandomColumns& out) {
  for (std::size_t first = 0; first < count; first += kLanes) {
    alignas(64) std::uint32_t c[4][kLanes], k[2][kLanes];
    for (std::size_t i = 0; i < kLanes; ++i) {
      c[0][i] = scratch.number[0][first + i];
      c[1][i] = scratch.number[1][first + i];
      c[2][i] = bounce;
      c[3][i] = static_cast<std::uint32_t>(use);
      k[0][i] = scratch.key[0][first + i];
      k[1][i] = scratch.key[1][first + i];
    }
    for (int round = 0; round < 10; ++round) {
      for (std::size_t i = 0; i < kLanes; ++i) {
        const std::uint64_t a = std::uint64_t{0xD2511F53u} * c[0][i];
        const std::uint64_t b = std::uint64_t{0xCD9E8D57u} * c[2][i];
        const std::uint32_t c1 = c[1][i], c3 = c[3][i];
        c[0][i] = static_cast<std::uint32_t>(b >> 32) ^ c1 ^ k[0][i];
        c[1][i] = static_cast<std::uint32_t>(b);
        c[2][i] = static_cast<std::uint32_t>(a >> 32) ^ c3 ^ k[1][i];
        c[3][i] = static_cast<std::uint32_t>(a);
        k[0][i] += 0x9E3779B9u;
        k[1][i] += 0xBB67AE85u;
      }
    }
    for (std::size_t w = 0; w < 4; ++w)
      for (std::size_t i = 0; i < kLanes; ++i) out.words[w][first + i] = c[w][i];
  }
}

// Notes who hit what; tallies those who left the level or are too old. Returns how many hit.
std::size_t meet(const ShadeArguments& with) {
  ShadeScratch& scratch = with.scratch;
  std::size_t count = 0;
  for (std::size_t i = 0; i < with.alive.size(); ++i) {
    KernelPhoton& photon = with.photons[with.alive[i]];
    const SurfaceHit& hit = with.hits[i];
    TraceTally& tally = with.runs[photon.run].tally;
    std::array<double, kBandCount>* lost = nullptr;
    if (hit.material == SurfaceHit::kNone) {
      ++tally.escaped;
      lost = &tally.power_escaped;
    } else {
      photon.travelled_m += static_cast<double>(hit.distance_m);
      if (photon.travelled_m > with.settings.longest_m || with.bounce > with.settings.most_bounces)
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
    scratch.slot[count] = with.alive[i];
    scratch.hit[count] = static_cast<std::uint32_t>(i);
    scratch.key[0][count] = static_cast<std::uint32_t>(photon.key);
    scratch.key[1][count] = static_cast<std::uint32_t>(photon.key >> 32);
    scratch.number[0][count] = static_cast<std::uint32_t>(photon.number);
    scratch.number[1][count] = static_cast<std::uint32_t>(photon.number >> 32);
    ++count;
  }
  return count;
}

// Air and surface take their share of each band.
void absorb(const ShadeArguments& with, std::size_t count) {
  ShadeScratch& scratch = with.scratch;
  const Bands air = with.settings.air_log2_loss_per_m;
  for (std::size_t j = 0; j < count; ++j) {
    KernelPhoton& photon = with.photons[scratch.slot[j]];
    const SurfaceHit& hit = with.hits[scratch.hit[j]];
    const KernelMaterial& material = with.materials[hit.material];
    alignas(32) float before[kBandCount], after[kBandCount], reflected[kBandCount];
    for (std::size_t b = 0; b < kBandCount; ++b) {
      const float power = photon.power[b];
      const float left = power * exp2_of(-air[b] * hit.distance_m) * material.kept[b];
      before[b] = power * photon.weight[b];
      after[b] = left * photon.weight[b];
      reflected[b] = after[b] * material.reflected_of_kept[b];
      photon.power[b] = left;
      scratch.left[j][b] = after[b];
    }
    scratch.before[j] = greatest_of(before);
    scratch.after[j] = greatest_of(after);
    scratch.reflected[j] = sum_of(reflected);
  }
}

// Roulette's odds and the numbers that a deposit carries.
void decide(const ShadeArguments& with, std::size_t count) {
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
    scratch.roulette[j] = unit_of(scratch.fate.words[2][j]);
    scratch.keep[j] = unit_of(scratch.fate.words[3][j]);
  }
}

CLAMOR_INLINE void put_deposit(const ShadeArguments& with, const KernelPhoton& photon,
                               const SurfaceHit& hit, const float* power, float scale, float u,
                               bool positive, bool through) {
  const KernelRun& run = with.runs[photon.run];
  const Vec3f point_m = photon.origin_m + photon.direction * hit.distance_m;
  Source& deposit = with.sink.deposits[with.sink.count];
  deposit.position_m = point_m;
  deposit.normal = through ? -hit.normal : hit.normal;
  deposit.mirror = through ? photon.direction : photon.direction + hit.normal * (2 * hit.cos_i);
  deposit.delay_s = static_cast<float>(photon.travelled_m / with.settings.speed_mps);
  for (std::size_t b = 0; b < kBandCount; ++b) deposit.power[b] = power[b] * scale;
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

// Kept for certain from `least` on; below, with probability power / least, and then raised to it.
// Returns the factor to its power, 0 where it is dropped.
CLAMOR_INLINE float kept_scale(float power, float least, float draw) {
  if (!(power > 0)) return 0;
  if (power >= least) return 1;
  return draw * least < power ? least / power : 0;
}

// Leaves the deposits and plays roulette. Returns how many go on.
std::size_t deposit_and_survive(const ShadeArguments& with, std::size_t count) {
  ShadeScratch& scratch = with.scratch;
  std::size_t going = 0;
  for (std::size_t j = 0; j < count; ++j) {
    if (!(scratch.after[j] > 0)) continue;
    KernelPhoton& photon = with.photons[scratch.slot[j]];
    const SurfaceHit& hit = with.hits[scratch.hit[j]];
    const KernelMaterial& material = with.materials[hit.material];
    const float least = with.runs[photon.run].least_power;
    const float scale = kept_scale(scratch.reflected[j], least, scratch.keep[j]);
    const bool positive = (scratch.fate.words[1][j] & 1) != 0;
    if (!material.transmits) {
      if (scale > 0)
        put_deposit(with, photon, hit, scratch.left[j].data(), scale, scratch.u[j], positive,
                    false);
    } else {
      alignas(32) float part[kBandCount];
      if (scale > 0) {
        for (std::size_t b = 0; b < kBandCount; ++b)
          part[b] = scratch.left[j][b] * material.reflected_of_kept[b];
        put_deposit(with, photon, hit, part, scale, scratch.u[j], positive, false);
      }
      for (std::size_t b = 0; b < kBandCount; ++b)
        part[b] = scratch.left[j][b] * material.through_of_kept[b];
      const RandomBits bits =
          philox(photon.key, {static_cast<std::uint32_t>(photon.number),
                              static_cast<std::uint32_t>(photon.number >> 32), with.bounce,
                              static_cast<std::uint32_t>(Use::kTransmission)});
      const float through_scale = kept_scale(sum_of(part), least, unit_of(bits[2]));
      if (through_scale > 0)
        put_deposit(with, photon, hit, part, through_scale,
                    static_cast<float>((bits[0] >> 8) + 1) * 0x1p-24f, (bits[1] & 1) != 0, true);
    }

    if (scratch.roulette[j] >= scratch.survival[j]) continue;
    const float gain = 1 / scratch.survival[j];
    for (std::size_t b = 0; b < kBandCount; ++b) photon.power[b] *= gain;
    scratch.going_slot[going] = scratch.slot[j];
    scratch.going_hit[going] = scratch.hit[j];
    // The random numbers' columns are for those that go on from here.
    scratch.key[0][going] = scratch.key[0][j];
    scratch.key[1][going] = scratch.key[1][j];
    scratch.number[0][going] = scratch.number[0][j];
    scratch.number[1][going] = scratch.number[1][j];
    ++going;
  }
  return going;
}

// Which band's law draws the direction, and on which side of the surface.
void choose_laws(const ShadeArguments& with, std::size_t count) {
  ShadeScratch& scratch = with.scratch;
  for (std::size_t k = 0; k < count; ++k) {
    const KernelPhoton& photon = with.photons[scratch.going_slot[k]];
    const SurfaceHit& hit = with.hits[scratch.going_hit[k]];
    const KernelMaterial& material = with.materials[hit.material];
    std::size_t drawn = 0;
    if (!material.alike || material.transmits) {
      const float place = unit_of(scratch.first.words[3][k]) * kBandCount;
      float below = 0;
      for (std::size_t b = 0; b + 1 < kBandCount; ++b) {
        below += photon.weight[b];
        drawn += place >= below ? 1 : 0;
      }
    }
    scratch.drawn[k] = static_cast<std::uint8_t>(drawn);
    const bool through =
        material.transmits && unit_of(scratch.second.words[3][k]) < material.through_of_kept[drawn];
    const Vec3f normal = through ? -hit.normal : hit.normal;
    const Vec3f mirror =
        through ? photon.direction : photon.direction + hit.normal * (2 * hit.cos_i);
    for (int axis = 0; axis < 3; ++axis) {
      scratch.normal[axis][k] = normal[axis];
      scratch.mirror[axis][k] = mirror[axis];
    }
    scratch.through[k] = through ? 1 : 0;
    scratch.cos_i[k] = hit.cos_i;
    scratch.scattering[k] = material.scattering[drawn];
    scratch.inverse_exponent[k] = material.inverse_exponent[drawn];
    const bool first = with.bounce == 1;
    scratch.u1[k] = first ? photon.first_bounce[0] : unit_of(scratch.first.words[1][k]);
    scratch.u2[k] = first ? photon.first_bounce[1] : unit_of(scratch.first.words[2][k]);
  }
}

// A direction at angle a (given its cosine) to a unit axis, turned by the share `turn` of a circle.
// The basis is Duff's, as in common/vec.h.
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

// Draws from Lambert's law or about the mirror direction.
void propose(ShadeScratch& scratch, std::size_t count) {
  for (std::size_t k = 0; k < count; ++k) {
    const bool lambert = unit_of(scratch.first.words[0][k]) < scratch.scattering[k];
    const float left = 1 - scratch.u1[k];
    const float cos_lambert = std::sqrt(left);
    const float cos_lobe = exp2_of(log2_of(left) * scratch.inverse_exponent[k]);
    const float nx = scratch.normal[0][k], ny = scratch.normal[1][k], nz = scratch.normal[2][k];
    const float mx = scratch.mirror[0][k], my = scratch.mirror[1][k], mz = scratch.mirror[2][k];
    const Vec3f way = around(lambert ? nx : mx, lambert ? ny : my, lambert ? nz : mz,
                             lambert ? cos_lambert : cos_lobe, scratch.u2[k]);
    const float cos_o = way.x * nx + way.y * ny + way.z * nz;
    const float u3 = unit_of(scratch.second.words[0][k]);
    scratch.direction[0][k] = way.x;
    scratch.direction[1][k] = way.y;
    scratch.direction[2][k] = way.z;
    const bool accepted = lambert || (cos_o > 0 && u3 * scratch.cos_i[k] <= cos_o);
    scratch.rejected[k] = accepted ? 0 : 1;
  }
}

// Proposals that went below the surface, or were not taken, leave by the law's second term.
void compensate(const ShadeArguments& with, std::size_t count) {
  ShadeScratch& scratch = with.scratch;
  for (std::size_t k = 0; k < count; ++k) {
    if (scratch.rejected[k] == 0) continue;
    const KernelMaterial& material = with.materials[with.hits[scratch.going_hit[k]].material];
    const PhongLobe& lobe = *material.lobes[scratch.drawn[k]];
    const auto cos_o =
        static_cast<float>(lobe.draw_compensation_cos(unit_of(scratch.second.words[1][k])));
    const Vec3f way = around(scratch.normal[0][k], scratch.normal[1][k], scratch.normal[2][k],
                             cos_o, unit_of(scratch.second.words[2][k]));
    for (int axis = 0; axis < 3; ++axis) scratch.direction[axis][k] = way[axis];
  }
}

// The angles that the law's density needs.
void measure(ShadeScratch& scratch, std::size_t count) {
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
    // Behind the mirror direction's equator there is no lobe: 2^-126 stands for nothing.
    scratch.log2_cos_a[k] = cos_a > 1e-30f ? log2_of(cos_a > 1e-30f ? cos_a : 1.0f) : -1e30f;
    const float safe_i = cos_i > 1e-9f ? cos_i : 1e-9f;
    const float ratio = cos_o / safe_i;
    scratch.ratio[k] = ratio < 1 ? ratio : 1.0f;
    const float up_i = cos_i < 1 ? cos_i : 1.0f;
    const float up_o = cos_o < 0 ? 0.0f : cos_o < 1 ? cos_o : 1.0f;
    scratch.loss_place_i[k] = std::sqrt(up_i) * kLossCells;
    scratch.loss_place_o[k] = std::sqrt(up_o) * kLossCells;
  }
}

// The path's band weights after the direction: w <- 8 w q / sum(w q). Leaves the next ray. Returns
// how many are alive, listed in order.
std::size_t reweight(const ShadeArguments& with, std::size_t count) {
  ShadeScratch& scratch = with.scratch;
  std::size_t alive = 0;
  for (std::size_t k = 0; k < count; ++k) {
    KernelPhoton& photon = with.photons[scratch.going_slot[k]];
    const SurfaceHit& hit = with.hits[scratch.going_hit[k]];
    const KernelMaterial& material = with.materials[hit.material];
    const bool through = scratch.through[k] != 0;
    if (!material.alike || material.transmits) {
      alignas(32) float q[kBandCount];
      const float cos_o = scratch.cos_o[k];
      if (material.alike) {
        for (std::size_t b = 0; b < kBandCount; ++b) q[b] = photon.weight[b];
      } else {
        const auto row_i =
            std::min(static_cast<std::size_t>(scratch.loss_place_i[k]), kLossCells - 1);
        const auto row_o =
            std::min(static_cast<std::size_t>(scratch.loss_place_o[k]), kLossCells - 1);
        const float part_i = scratch.loss_place_i[k] - static_cast<float>(row_i);
        const float part_o = scratch.loss_place_o[k] - static_cast<float>(row_o);
        const Bands* const i = &material.lost[row_i];
        const Bands* const o = &material.lost[row_o];
        const float log2_cos_a = scratch.log2_cos_a[k], ratio = scratch.ratio[k];
        const bool lobe = log2_cos_a > -1e29f;
        for (std::size_t b = 0; b < kBandCount; ++b) {
          const float lost_i = i[0][b] + part_i * (i[1][b] - i[0][b]);
          const float lost_o = o[0][b] + part_o * (o[1][b] - o[0][b]);
          const float shape = exp2_of(material.exponent[b] * log2_cos_a);
          const float density = cos_o * (material.scattering[b] * std::numbers::inv_pi_v<float> +
                                         material.compensation[b] * lost_i * lost_o) +
                                (lobe ? material.lobe[b] * shape * ratio : 0.0f);
          q[b] = photon.weight[b] * density;
        }
      }
      if (material.transmits)
        for (std::size_t b = 0; b < kBandCount; ++b)
          q[b] *= through ? material.through_of_kept[b] : 1 - material.through_of_kept[b];
      const float sum = sum_of(q);
      if (!(sum > 1e-30f)) continue;
      const float scale = static_cast<float>(kBandCount) / sum;
      for (std::size_t b = 0; b < kBandCount; ++b) photon.weight[b] = q[b] * scale;
    }
    if (!(scratch.cos_o[k] > 0)) continue;
    const float offset_m = through ? -with.settings.offset_m : with.settings.offset_m;
    photon.origin_m = photon.origin_m + photon.direction * hit.distance_m + hit.normal * offset_m;
    photon.direction = {scratch.direction[0][k], scratch.direction[1][k], scratch.direction[2][k]};
    with.alive[alive++] = scratch.going_slot[k];
  }
  return alive;
}

std::size_t shade_here(const ShadeArguments& with) {
  const std::size_t met = meet(with);
  absorb(with, met);
  decide(with, met);
  const std::size_t going = deposit_and_survive(with, met);
  draw(with.scratch, going, with.bounce, Use::kReflection, with.scratch.first);
  draw(with.scratch, going, with.bounce, Use::kRetry, with.scratch.second);
  choose_laws(with, going);
  propose(with.scratch, going);
  compensate(with, going);
  measure(with.scratch, going);
  return reweight(with, going);
}

}  // namespace
}  // namespace HWY_NAMESPACE
}  // namespace clamor
HWY_AFTER_NAMESPACE();

#if HWY_ONCE

namespace clamor {

namespace {
HWY_EXPORT(shade_here);
}  // namespace

std::size_t shade(const KernelSettings& settings, std::span<const KernelMaterial> materials,
                  std::uint32_t bounce, std::span<KernelPhoton> photons,
                  std::span<std::uint16_t> alive, std::span<const SurfaceHit> hits,
                  std::span<KernelRun> runs, ShadeScratch& scratch, DepositSink& sink) {
  return HWY_DYNAMIC_DISPATCH(shade_here)(
      {settings, materials, bounce, photons, alive, hits, runs, scratch, sink});
}

void TraceTally::add(const TraceTally& other, double power_share) {
  photons += other.photons;
  bounces += other.bounces;
  escaped += other.escaped;
  legs_m += other.legs_m;
  legs += other.legs;
  for (std::size_t b = 0; b < kBandCount; ++b) {
    power_escaped[b] += other.power_escaped[b] * power_share;
    power_unfinished[b] += other.power_unfinished[b] * power_share;
  }
}

void DeleteScratch::operator()(ShadeScratch* scratch) const { delete scratch; }

std::unique_ptr<ShadeScratch, DeleteScratch> make_shade_scratch() {
  return std::unique_ptr<ShadeScratch, DeleteScratch>(new ShadeScratch());
}

std::vector<KernelMaterial> kernel_materials(std::span<const Material> materials,
                                             std::vector<std::unique_ptr<PhongLobe>>& lobes) {
  const auto lobe_of = [&lobes](double exponent) -> const PhongLobe* {
    for (const auto& lobe : lobes)
      if (lobe->exponent() == exponent) return lobe.get();
    return lobes.emplace_back(std::make_unique<PhongLobe>(exponent)).get();
  };
  std::vector<KernelMaterial> tables;
  for (const Material& material : materials) {
    KernelMaterial table;
    bool any_lobe = false;
    for (std::size_t b = 0; b < kBandCount; ++b) {
      const float reflected = 1 - material.absorption[b];
      const float through = std::min(material.transmission[b], material.absorption[b]);
      table.kept[b] = reflected + through;
      table.through_of_kept[b] = through > 0 ? through / table.kept[b] : 0;
      table.reflected_of_kept[b] = 1 - table.through_of_kept[b];
      table.transmits |= through > 0;
      const bool lambert = material.scattering[b] >= 1 || material.phong[b] <= 0;
      table.scattering[b] = lambert ? 1 : material.scattering[b];
      table.exponent[b] = lambert ? 0 : material.phong[b];
      table.inverse_exponent[b] = 1 / (table.exponent[b] + 1);
      if (lambert) continue;
      any_lobe = true;
      const PhongLobe* const lobe = lobe_of(static_cast<double>(material.phong[b]));
      const double rest = 1 - static_cast<double>(material.scattering[b]);
      table.lobes[b] = lobe;
      table.lobe[b] = static_cast<float>(rest * (lobe->exponent() + 1) / (2 * std::numbers::pi));
      table.compensation[b] =
          static_cast<float>(rest / (std::numbers::pi * (1 - lobe->mean_albedo())));
    }
    table.alike = std::all_of(table.scattering.begin(), table.scattering.end(),
                              [&](float s) { return s == table.scattering[0]; }) &&
                  std::all_of(table.exponent.begin(), table.exponent.end(),
                              [&](float p) { return p == table.exponent[0]; });
    if (any_lobe) {
      table.lost.resize(kLossCells + 1, Bands{});
      for (std::size_t k = 0; k <= kLossCells; ++k) {
        const double root = static_cast<double>(k) / kLossCells;
        for (std::size_t b = 0; b < kBandCount; ++b)
          if (table.lobes[b] != nullptr)
            table.lost[k][b] = static_cast<float>(1 - table.lobes[b]->albedo(root * root));
      }
    } else {
      table.lost.resize(kLossCells + 1, Bands{});
    }
    tables.push_back(std::move(table));
  }
  return tables;
}

std::vector<std::string> trace_kernel_targets() {
  std::vector<std::string> names;
  for (std::int64_t targets = hwy::SupportedTargets() & HWY_TARGETS; targets != 0;
       targets &= targets - 1)
    names.emplace_back(hwy::TargetName(targets & -targets));
  return names;
}

void force_trace_kernel_target(const std::string& name) {
  hwy::SetSupportedTargetsForTest(0);
  if (name.empty()) return;
  for (std::int64_t targets = hwy::SupportedTargets() & HWY_TARGETS; targets != 0;
       targets &= targets - 1)
    if (name == hwy::TargetName(targets & -targets)) {
      hwy::SetSupportedTargetsForTest(targets & -targets);
      return;
    }
}

}  // namespace clamor

#endif  // HWY_ONCE
