#include "bake/probes/diffuse_late_field.h"

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <numbers>
#include <numeric>
#include <vector>

#include "common/bands.h"
#include "common/maths.h"
#include "common/random.h"
#include "common/sphere.h"
#include "common/thread_team.h"

namespace clamor {

namespace {

// Rays per source: one by its material's law in every other band, and as many by the cosine law.
constexpr std::size_t kLawRays = 4, kRays = 2 * kLawRays, kBandsPerRay = kBandCount / kLawRays;
constexpr std::uint32_t kSeedOfRays = 0x64696666;
constexpr double kFromSurfaces_m = 1;  // of listeners
// Factors are measured over so many sources at least: that leaves a noise of 0.1 dB.
constexpr std::size_t kSourcesPerMoment = 1600, kMostMoments = 8;
constexpr double kMostFactor_log2 = 2;  // either way

// Energies in the air, up to a constant.
struct AirEnergy {
  std::array<double, kBandCount> by_law{}, by_cosine{};
};

// The length of the part of a ray that is far enough from the planes at its ends. What leaves the
// level does not come back.
double open_length_m(const SurfaceHit& hit, double cos_o) {
  if (hit.material == SurfaceHit::kNone) return 0;
  const double cos_i = std::max(static_cast<double>(hit.cos_i), 1e-6);
  return std::max(0.0,
                  static_cast<double>(hit.distance_m) - kFromSurfaces_m * (1 / cos_o + 1 / cos_i));
}

Vec3 draw_direction(const Source& source, std::size_t number, std::size_t ray,
                    const ReflectionLaws& laws) {
  const auto draw = [&](std::uint32_t use) {
    return philox(kSeedOfRays,
                  {static_cast<std::uint32_t>(number), static_cast<std::uint32_t>(ray), use, 0});
  };
  const RandomBits a = draw(0);
  const Vec3 normal(source.normal);
  if (ray >= kLawRays) return normalize(normal + on_sphere(1 - 2 * unit(a[0]), unit(a[1])));
  const RandomBits b = draw(1);
  return laws.draw(source.material, ray * kBandsPerRay, mirrored(Vec3(source.mirror), normal),
                   normal,
                   {unit(a[0]), unit(a[1]), unit(a[2]), unit(a[3]), unit(b[0]), unit(b[1])});
}

AirEnergy air_energy(const Source& source, std::size_t number, const Scene& scene,
                     const ReflectionLaws& laws) {
  const Vec3 normal(source.normal), mirror(source.mirror);
  const Vec3f origin_m(scene.away_from_surface(Vec3(source.position_m), normal));
  std::array<Vec3, kRays> directions;
  std::array<Ray, kRays> rays;
  std::array<SurfaceHit, kRays> hits;
  for (std::size_t r = 0; r < kRays; ++r) {
    directions[r] = draw_direction(source, number, r, laws);
    rays[r] = {origin_m, Vec3f(directions[r])};
  }
  scene.first_hits(rays, hits);
  AirEnergy energy;
  for (std::size_t r = 0; r < kRays; ++r) {
    const double cos_o = dot(directions[r], normal);
    const double length_m = cos_o > 0 ? open_length_m(hits[r], cos_o) : 0;
    if (!(length_m > 0)) continue;
    const Bands by_law = laws.density(source.material, dot(mirror, normal), cos_o,
                                      std::min(dot(directions[r], mirror), 1.0));
    const double by_cosine = cos_o / std::numbers::pi;
    // The balance heuristic divides by the density of all rays together.
    double of_rays = kLawRays * by_cosine;
    for (std::size_t l = 0; l < kLawRays; ++l)
      of_rays += static_cast<double>(by_law[l * kBandsPerRay]);
    for (std::size_t b = 0; b < kBandCount; ++b) {
      const double share = static_cast<double>(source.power[b]) * length_m / of_rays;
      energy.by_law[b] += share * static_cast<double>(by_law[b]);
      energy.by_cosine[b] += share * by_cosine;
    }
  }
  return energy;
}

// Binary logarithms of the factors on the power of sources of about this time.
struct Moment {
  double delay_s = 0;
  std::array<double, kBandCount> factor_log2{};
};

Moment moment_of(std::span<const std::uint32_t> members, std::span<const Source> sources,
                 std::span<const AirEnergy> energies) {
  Moment moment;
  AirEnergy sum;
  for (const std::uint32_t i : members) {
    moment.delay_s += static_cast<double>(sources[i].delay_s) / static_cast<double>(members.size());
    for (std::size_t b = 0; b < kBandCount; ++b) {
      sum.by_law[b] += energies[i].by_law[b];
      sum.by_cosine[b] += energies[i].by_cosine[b];
    }
  }
  for (std::size_t b = 0; b < kBandCount; ++b)
    if (sum.by_law[b] > 0 && sum.by_cosine[b] > 0)
      moment.factor_log2[b] = std::clamp(log2_of(sum.by_law[b] / sum.by_cosine[b]),
                                         -kMostFactor_log2, kMostFactor_log2);
  return moment;
}

// Equally many sources make up each moment. Moments ascend.
std::vector<Moment> moments_of(std::span<const Source> sources,
                               std::span<const AirEnergy> energies) {
  std::vector<std::uint32_t> by_delay(sources.size());
  std::iota(by_delay.begin(), by_delay.end(), 0);
  std::ranges::stable_sort(by_delay, {}, [&](std::uint32_t i) { return sources[i].delay_s; });
  const std::size_t count =
      std::clamp<std::size_t>(sources.size() / kSourcesPerMoment, 1, kMostMoments);
  std::vector<Moment> moments;
  for (std::size_t m = 0; m < count; ++m) {
    const std::size_t first = m * sources.size() / count, end = (m + 1) * sources.size() / count;
    moments.push_back(
        moment_of(std::span(by_delay).subspan(first, end - first), sources, energies));
  }
  return moments;
}

// Linear in decibels between moments, constant before the first and after the last.
Bands factors_at(std::span<const Moment> moments, double delay_s) {
  std::size_t next = 0;
  while (next < moments.size() && moments[next].delay_s <= delay_s) ++next;
  const Moment& after = moments[std::min(next, moments.size() - 1)];
  const Moment& before = moments[next == 0 ? 0 : next - 1];
  const double between_s = after.delay_s - before.delay_s;
  const double share = between_s > 0 ? (delay_s - before.delay_s) / between_s : 0;
  Bands factors;
  for (std::size_t b = 0; b < kBandCount; ++b)
    factors[b] = static_cast<float>(
        exp2_of(before.factor_log2[b] + share * (after.factor_log2[b] - before.factor_log2[b])));
  return factors;
}

}  // namespace

void make_diffuse(std::span<Source> sources, const Scene& scene, const ReflectionLaws& laws) {
  if (sources.empty()) return;
  std::vector<AirEnergy> energies(sources.size());
  team_for(0, sources.size(), 256,
           [&](std::size_t i) { energies[i] = air_energy(sources[i], i, scene, laws); });
  const std::vector<Moment> moments = moments_of(sources, energies);
  for (Source& source : sources) {
    const Bands factors = factors_at(moments, static_cast<double>(source.delay_s));
    for (std::size_t b = 0; b < kBandCount; ++b) source.power[b] *= factors[b];
    source.mirror = source.normal;
  }
}

}  // namespace clamor
