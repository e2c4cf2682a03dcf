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

// Arrays over the photons of a step, so that lanes can run along them. Padded: at 4096 bytes apart
// a read of one would wait for a write to another, and all would share a few lines of the cache.
template <class T>
using Column = std::array<T, kStepPhotons + 48>;
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
  RandomColumns way;
  Column<std::uint32_t> band_bits, lambert_bits;
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
  std::span<Ray> rays;
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

// Eight bands in one register, where the instruction set has one of that size.
typedef float BandVector __attribute__((vector_size(4 * kBandCount)));
typedef std::int32_t BandInts __attribute__((vector_size(4 * kBandCount)));
typedef float FourFloats __attribute__((vector_size(16)));

CLAMOR_INLINE BandVector load(const Bands& bands) {
  BandVector vector;
  __builtin_memcpy(&vector, bands.data(), sizeof vector);
  return vector;
}
CLAMOR_INLINE void store(BandVector vector, Bands& bands) {
  __builtin_memcpy(bands.data(), &vector, sizeof vector);
}

// The sum and the greatest of eight, in one order on every machine.
CLAMOR_INLINE float sum_of(BandVector x) {
  const FourFloats four =
      __builtin_shufflevector(x, x, 0, 1, 2, 3) + __builtin_shufflevector(x, x, 4, 5, 6, 7);
  const FourFloats two = four + __builtin_shufflevector(four, four, 2, 3, 2, 3);
  return two[0] + two[1];
}
CLAMOR_INLINE float greatest_of(BandVector x) {
  const FourFloats low = __builtin_shufflevector(x, x, 0, 1, 2, 3);
  const FourFloats high = __builtin_shufflevector(x, x, 4, 5, 6, 7);
  const FourFloats four = low > high ? low : high;
  const FourFloats turned = __builtin_shufflevector(four, four, 2, 3, 2, 3);
  const FourFloats two = four > turned ? four : turned;
  return two[0] > two[1] ? two[0] : two[1];
}

// exp2_of() of common/maths.h in every lane, to the same bits.
CLAMOR_INLINE BandVector exp2_of_bands(BandVector x) {
  const BandVector low = BandVector{} - 126, high = BandVector{} + 126;
  const BandVector round = BandVector{} + 12582912.0f;
  x = x < low ? low : x;
  x = x > high ? high : x;
  const BandVector n = (x + round) - round;
  const BandVector f = x - n;
  const BandVector series =
      1.0f +
      f * (0.693147181f +
           f * (0.240226507f +
                f * (5.55041087e-2f +
                     f * (9.61812911e-3f +
                          f * (1.33335581e-3f + f * (1.54035304e-4f + f * 1.52527338e-5f))))));
  const BandInts scale = (__builtin_convertvector(n, BandInts) + 127) << 23;
  return series * (BandVector)scale;
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
[[gnu::noinline]] std::size_t meet(const ShadeArguments& with) {
  const auto photons = with.photons;
  const auto hits = with.hits;
  const auto runs = with.runs;
  const auto slots = with.alive;
  ShadeScratch& scratch = with.scratch;
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

// Air and surface take their share of each band.
void absorb(const ShadeArguments& with, std::size_t count) {
  const auto photons = with.photons;
  const auto hits = with.hits;
  const auto materials = with.materials;
  ShadeScratch& scratch = with.scratch;
  const BandVector air = load(with.settings.air_log2_loss_per_m);
  for (std::size_t j = 0; j < count; ++j) {
    KernelPhoton& photon = photons[scratch.slot[j]];
    const SurfaceHit& hit = hits[scratch.hit[j]];
    const KernelMaterial& material = materials[hit.material];
    const BandVector power = load(photon.power), weight = load(photon.weight);
    const BandVector left = power * exp2_of_bands(air * -hit.distance_m) * load(material.kept);
    const BandVector after = left * weight;
    store(left, photon.power);
    store(after, scratch.left[j]);
    scratch.before[j] = greatest_of(power * weight);
    scratch.after[j] = greatest_of(after);
    scratch.reflected[j] = sum_of(after * load(material.reflected_of_kept));
  }
}

// Roulette's odds and the numbers that a deposit carries. Of the four random words the high 24 bits
// are the deposit's u, roulette, the band that draws, and the choice of Lambert; the lowest bit of
// the first is the sign, and the low bytes of the others decide whether a weak deposit is kept.
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
  deposit.delay_s = static_cast<float>(photon.travelled_m / with.settings.speed_mps);
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

// Kept for certain from `least` on; below, with probability (power / least)^(1/4), and then
// carrying the inverse times as much. Returns the factor to its power, 0 where it is dropped.
CLAMOR_INLINE float kept_scale(float power, float least, float draw) {
  if (!(power > 0)) return 0;
  if (power >= least) return 1;
  const float odds = std::sqrt(std::sqrt(power / least));
  return draw < odds ? 1 / odds : 0;
}

// Leaves the deposits and plays roulette. Returns how many go on.
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
    const float least = runs[photon.run].least_power;
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
    // The random numbers' columns are for those that go on from here.
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

// Which band's law draws the direction, and on which side of the surface. Of the random words the
// high 24 bits are two of the direction and one of its acceptance, the fourth is for those not
// accepted, and the low bytes choose the side.
[[gnu::noinline]] void choose_laws(const ShadeArguments& with, std::size_t count) {
  const auto photons = with.photons;
  const auto hits = with.hits;
  const auto materials = with.materials;
  const auto rays = with.rays;
  ShadeScratch& scratch = with.scratch;
  for (std::size_t k = 0; k < count; ++k) {
    const KernelPhoton& photon = photons[scratch.going_slot[k]];
    const SurfaceHit& hit = hits[scratch.going_hit[k]];
    const KernelMaterial& material = materials[hit.material];
    std::size_t drawn = 0;
    if (!material.alike || material.transmits) {
      const float place = unit_of(scratch.band_bits[k]) * kBandCount;
      float below = 0;
      for (std::size_t b = 0; b + 1 < kBandCount; ++b) {
        below += photon.weight[b];
        drawn += place >= below ? 1 : 0;
      }
    }
    scratch.drawn[k] = static_cast<std::uint8_t>(drawn);
    const bool through =
        material.transmits &&
        unit_of(scratch.way.words[0][k] << 24 | (scratch.way.words[1][k] & 255) << 16 |
                (scratch.way.words[2][k] & 255) << 8) < material.through_of_kept[drawn];
    const Vec3f normal = through ? -hit.normal : hit.normal;
    const Vec3f arrival = rays[scratch.going_hit[k]].direction;
    const Vec3f mirror = through ? arrival : arrival + hit.normal * (2 * hit.cos_i);
    for (int axis = 0; axis < 3; ++axis) {
      scratch.normal[axis][k] = normal[axis];
      scratch.mirror[axis][k] = mirror[axis];
    }
    scratch.through[k] = through ? 1 : 0;
    scratch.cos_i[k] = hit.cos_i;
    scratch.scattering[k] = material.scattering[drawn];
    scratch.inverse_exponent[k] = material.inverse_exponent[drawn];
    const bool first = with.bounce == 1;
    scratch.u1[k] = first ? photon.first_bounce[0] : unit_of(scratch.way.words[0][k]);
    scratch.u2[k] = first ? photon.first_bounce[1] : unit_of(scratch.way.words[1][k]);
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
[[gnu::noinline]] void propose(ShadeScratch& scratch, std::size_t count) {
  for (std::size_t k = 0; k < count; ++k) {
    const bool lambert = unit_of(scratch.lambert_bits[k]) < scratch.scattering[k];
    const float left = 1 - scratch.u1[k];
    const float cos_lambert = std::sqrt(left);
    const float cos_lobe = exp2_of(log2_of(left) * scratch.inverse_exponent[k]);
    const float nx = scratch.normal[0][k], ny = scratch.normal[1][k], nz = scratch.normal[2][k];
    const float mx = scratch.mirror[0][k], my = scratch.mirror[1][k], mz = scratch.mirror[2][k];
    const Vec3f way = around(lambert ? nx : mx, lambert ? ny : my, lambert ? nz : mz,
                             lambert ? cos_lambert : cos_lobe, scratch.u2[k]);
    const float cos_o = way.x * nx + way.y * ny + way.z * nz;
    const float u3 = unit_of(scratch.way.words[2][k]);
    scratch.direction[0][k] = way.x;
    scratch.direction[1][k] = way.y;
    scratch.direction[2][k] = way.z;
    const bool accepted = lambert || (cos_o > 0 && u3 * scratch.cos_i[k] <= cos_o);
    scratch.rejected[k] = accepted ? 0 : 1;
  }
}

// Proposals that went below the surface, or were not taken, leave by the law's second term.
[[gnu::noinline]] void compensate(const ShadeArguments& with, std::size_t count) {
  const auto hits = with.hits;
  const auto materials = with.materials;
  ShadeScratch& scratch = with.scratch;
  for (std::size_t k = 0; k < count; ++k) {
    if (scratch.rejected[k] == 0) continue;
    const KernelMaterial& material = materials[hits[scratch.going_hit[k]].material];
    const PhongLobe& lobe = *material.lobes[scratch.drawn[k]];
    const std::uint32_t bits = scratch.way.words[3][k];  // 16 for the angle, 16 for the turn
    const auto cos_o =
        static_cast<float>(lobe.draw_compensation_cos((bits >> 16) * 0x1p-16 + 0x1p-17));
    const Vec3f way = around(scratch.normal[0][k], scratch.normal[1][k], scratch.normal[2][k],
                             cos_o, static_cast<float>(bits & 0xffff) * 0x1p-16f);
    for (int axis = 0; axis < 3; ++axis) scratch.direction[axis][k] = way[axis];
  }
}

// The angles that the law's density needs.
[[gnu::noinline]] void measure(ShadeScratch& scratch, std::size_t count) {
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
    scratch.loss_place_i[k] = std::sqrt(up_i) * (kLossCells - 1e-4f);
    scratch.loss_place_o[k] = std::sqrt(up_o) * (kLossCells - 1e-4f);
  }
}

// The path's band weights after the direction: w <- 8 w q / sum(w q). Leaves the next ray. Returns
// how many are alive, listed in order.
[[gnu::noinline]] std::size_t reweight(const ShadeArguments& with, std::size_t count) {
  const auto photons = with.photons;
  const auto hits = with.hits;
  const auto materials = with.materials;
  const auto rays = with.rays;
  const auto slots = with.alive;
  ShadeScratch& scratch = with.scratch;
  std::size_t alive = 0;
  for (std::size_t k = 0; k < count; ++k) {
    KernelPhoton& photon = photons[scratch.going_slot[k]];
    const SurfaceHit& hit = hits[scratch.going_hit[k]];
    const KernelMaterial& material = materials[hit.material];
    const bool through = scratch.through[k] != 0;
    if (!(scratch.cos_o[k] > 0)) continue;
    if (!material.alike || material.transmits) {
      BandVector q = load(photon.weight);
      if (!material.alike) {
        const float place_i = scratch.loss_place_i[k], place_o = scratch.loss_place_o[k];
        const auto row_i = static_cast<std::int32_t>(place_i);
        const auto row_o = static_cast<std::int32_t>(place_o);
        const Bands* const i = &material.lost[static_cast<std::size_t>(row_i)];
        const Bands* const o = &material.lost[static_cast<std::size_t>(row_o)];
        const BandVector low_i = load(i[0]), low_o = load(o[0]);
        const BandVector lost_i =
            low_i + (place_i - static_cast<float>(row_i)) * (load(i[1]) - low_i);
        const BandVector lost_o =
            low_o + (place_o - static_cast<float>(row_o)) * (load(o[1]) - low_o);
        const BandVector lobe = load(material.lobe) *
                                exp2_of_bands(load(material.exponent) * scratch.log2_cos_a[k]) *
                                scratch.ratio[k];
        q *= scratch.cos_o[k] * (load(material.scattering) * std::numbers::inv_pi_v<float> +
                                 load(material.compensation) * lost_i * lost_o) +
             lobe;
      }
      if (material.transmits) {
        const BandVector share = load(material.through_of_kept);
        q *= through ? share : 1 - share;
      }
      const float sum = sum_of(q);
      if (!(sum > 1e-30f)) continue;
      store(q * (static_cast<float>(kBandCount) / sum), photon.weight);
    }
    const float offset_m = through ? -with.settings.offset_m : with.settings.offset_m;
    const Ray& ray = rays[scratch.going_hit[k]];
    const Vec3f origin_m = ray.origin_m + ray.direction * hit.distance_m + hit.normal * offset_m;
    rays[alive] = {origin_m,
                   {scratch.direction[0][k], scratch.direction[1][k], scratch.direction[2][k]}};
    slots[alive++] = scratch.going_slot[k];
  }
  return alive;
}

std::size_t shade_here(const ShadeArguments& with) {
  const std::size_t met = meet(with);
  absorb(with, met);
  decide(with, met);
  const std::size_t going = deposit_and_survive(with, met);
  draw(with.scratch, going, with.bounce, Use::kReflection, with.scratch.way);
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
                  std::span<std::uint16_t> alive, std::span<Ray> rays,
                  std::span<const SurfaceHit> hits, std::span<KernelRun> runs,
                  ShadeScratch& scratch, DepositSink& sink) {
  return HWY_DYNAMIC_DISPATCH(shade_here)(
      {settings, materials, bounce, photons, alive, rays, hits, runs, scratch, sink});
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
