#include "runtime/probes/first_reflection_tracer.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>

#include "common/directivity.h"
#include "common/random.h"
#include "common/sphere.h"
#include "common/thin_material.h"
#include "runtime/occlusion/occlusion_geometry.h"

namespace clamor {

namespace {

constexpr double kReach_m = 1000;
constexpr double kMinCosine = 0.05;      // of incidence, for patch radii
constexpr float kLeastMirrored = 1e-3f;  // share of the power, in the loudest band
// A cone is divided if the listener is nearer to its patch than so many times the patch's radius.
constexpr double kFarFromPatch = 4;

// A random rotation of all directions.
Matrix random_axes(std::uint64_t key) {
  const RandomBits bits = philox(key, {0, 0, 0, 0});
  const Vec3 up = on_sphere(1 - 2 * unit(bits[0]), unit(bits[1]));
  const Basis basis = basis_around(up);
  const Vec3 turn = on_sphere(0, unit(bits[2]));
  const Vec3 right = turn.x * basis.tangent + turn.y * basis.bitangent;
  return {right, cross(up, right), up};
}

// The rays of a set are every sixth of a Fibonacci sphere. Six turns by the golden ratio are 0.708
// of a turn, which no small fraction approximates, so each set is even, too; with four or eight, it
// would be a spiral of a few arms.
Vec3 direction_of(std::uint32_t ray) {
  static const auto directions = [] {
    std::array<Vec3, FirstReflectionTracer::kRays> all;
    for (std::uint32_t r = 0; r < FirstReflectionTracer::kRays; ++r)
      all[r] = spread_direction(r, FirstReflectionTracer::kRays);
    return all;
  }();
  return directions[ray];
}

// A ray with this share of the sphere illuminates an area of 4 pi share r^2 / cos i
// (patch_radius.h).
double patch_radius_m(double share, double distance_m, double cos_i) {
  return distance_m * std::sqrt(2 * share / std::max(cos_i, kMinCosine));
}

}  // namespace

// Directions that cover a ray's cone evenly: a cap of a Fibonacci sphere.
Vec3 FirstReflectionTracer::divided_direction(const Ray& ray, std::uint32_t part) {
  constexpr double kGolden = 0.6180339887498949;
  const double turn = part * kGolden;
  const Vec3 local =
      on_sphere(1 - 2 * ray.share * (part + 0.5) / kDivision, turn - std::floor(turn));
  const Basis basis = basis_around(ray.direction);
  return local.x * basis.tangent + local.y * basis.bitangent + local.z * ray.direction;
}

FirstReflectionTracer::FirstReflectionTracer(const OcclusionGeometry& surfaces,
                                             std::span<const Material> materials, const Air& air,
                                             std::span<const Portal> portals)
    : surfaces_(surfaces),
      loss_per_m_(air_loss_per_m(air)),
      speed_of_sound_mps_(clamor::speed_of_sound_mps(air)),
      portals_(portals) {
  for (const Material& material : materials) {
    Surface& surface = by_material_.emplace_back();
    surface.transmitted = material.transmission;
    surface.scattering = material.scattering;
    surface.mirrored = std::ranges::max(mirror_reflection(material));
    for (std::size_t b = 0; b < kBandCount; ++b) surface.reflected[b] = 1 - material.absorption[b];
    surface.transmits = is_thin(material);
  }
}

FirstReflectionTracer::Traced FirstReflectionTracer::trace(
    const Vec3& place_m, const Vec3& listener_m, std::uint64_t key, std::uint32_t set,
    std::vector<FirstReflection>& reflections) const {
  const Matrix axes = random_axes(key);
  std::vector<Ray> rays;
  for (std::uint32_t r = set; r < kRays; r += kSets)
    rays.push_back({axes * direction_of(r), 1.0 / kRays, r});
  Traced traced;
  for (; traced.rays < rays.size(); ++traced.rays) {
    const Ray ray = rays[traced.rays];
    const auto hit = first_hit(place_m, ray);
    if (!hit) continue;
    traced.nearest_m = std::min(traced.nearest_m, hit->distance_m);
    const bool is_far = length(hit->point_m - listener_m) > kFarFromPatch * hit->patch_radius_m;
    if (is_far || ray.number >= kLastDivided) {
      add(place_m, key, ray, *hit, reflections);
      continue;
    }
    for (std::uint32_t part = 0; part < kDivision; ++part)
      rays.push_back({divided_direction(ray, part), ray.share / kDivision,
                      kRays + ray.number * kDivision + part});
  }
  return traced;
}

std::optional<FirstReflectionTracer::Hit> FirstReflectionTracer::first_hit(const Vec3& place_m,
                                                                           const Ray& ray) const {
  const auto found =
      surfaces_.first_level_hit(Vec3f(place_m), Vec3f(place_m + kReach_m * ray.direction));
  if (!found) return std::nullopt;
  Hit hit;
  hit.distance_m = kReach_m * static_cast<double>(found->fraction);
  hit.point_m = place_m + hit.distance_m * ray.direction;
  const double cosine = dot(ray.direction, Vec3(found->normal));
  hit.normal = cosine < 0 ? Vec3(found->normal) : -Vec3(found->normal);
  hit.cos_i = std::abs(cosine);
  hit.patch_radius_m = patch_radius_m(ray.share, hit.distance_m, hit.cos_i);
  hit.material = found->material;
  return hit;
}

void FirstReflectionTracer::add(const Vec3& place_m, std::uint64_t key, const Ray& ray,
                                const Hit& hit, std::vector<FirstReflection>& reflections) const {
  FirstReflection reflection;
  Source& source = reflection.source;
  source.position_m = Vec3f(hit.point_m);
  source.normal = Vec3f(hit.normal);
  source.mirror = Vec3f(ray.direction + 2 * hit.cos_i * hit.normal);
  source.delay_s = static_cast<float>(hit.distance_m / speed_of_sound_mps_);
  source.patch_radius_m = static_cast<float>(hit.patch_radius_m);
  source.material = hit.material;
  for (std::size_t p = 0; p < portals_.size(); ++p)
    if (passes(portals_[p], place_m, hit.point_m)) reflection.portals.add(p);

  const Surface& surface = by_material_[hit.material];
  const auto add_side = [&](std::uint32_t side, const Bands& kept) {
    reflection.number = 2 * ray.number + side;
    const bool is_mirrored =
        side == 0 && surface.mirrored >= kLeastMirrored && reflection.portals.is_empty();
    reflection.mirrored_rays = is_mirrored ? static_cast<float>(ray.share * kRays) : 0;
    const RandomBits bits = philox(key, {1, reflection.number, 0, 0});
    source.u = static_cast<float>(unit_above_zero(bits[0]));
    source.polarity = (bits[1] & 1) != 0 ? 1 : -1;
    for (std::size_t b = 0; b < kBandCount; ++b)
      source.power[b] =
          static_cast<float>(emission_power(0) * ray.share * static_cast<double>(kept[b]) *
                             std::exp(-static_cast<double>(loss_per_m_[b]) * hit.distance_m));
    reflections.push_back(reflection);
  };
  add_side(0, surface.reflected);
  if (!surface.transmits) return;
  source.normal = -source.normal;
  source.mirror = Vec3f(ray.direction);
  add_side(1, surface.transmitted);
}

}  // namespace clamor
