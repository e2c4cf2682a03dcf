#include "runtime/probes/probe_sources.h"

#include <algorithm>
#include <cmath>
#include <new>
#include <utility>

#include "common/directivity.h"
#include "runtime/propagation/loudness.h"

namespace clamor {

namespace {

constexpr double kLeastDistance_m = 0.05;  // of a source to a surface that it illuminates

// Irradiance at a surface of a source of unit power at a distance, up to a constant.
double irradiance(double cos_at_surface, double distance_m) {
  const double r_m = std::max(distance_m, kLeastDistance_m);
  return std::abs(cos_at_surface) / (r_m * r_m);
}

// Redirects a source on the first surface to sound from `arriving`, and returns its power ratio.
double redirect(Source& source, const Vec3& from_probe_m, const Vec3& arriving, double distance_m) {
  const Vec3 normal(source.normal);
  const double probe_distance_m = std::max(length(from_probe_m), kLeastDistance_m);
  const double cos_probe = dot(from_probe_m, normal) / probe_distance_m;
  const double cos_now = dot(arriving, normal);
  // Sound that the surface transmits leaves on the far side, in its old direction. A source that
  // has passed the plane of the surface does not light this side of it.
  if (cos_probe * cos_now <= 0) return 0;
  source.mirror = Vec3f(cos_now < 0 ? arriving - 2 * cos_now * normal : arriving);
  const double at_probe = irradiance(cos_probe, probe_distance_m);
  return at_probe > 0 ? std::min(irradiance(cos_now, distance_m) / at_probe, kMaxIrradianceRatio)
                      : 0;
}

// Scales the power by a ratio and by the directivity towards the first surface.
void radiate(Source& source, const Vec3& direction, const MovingRadiator& radiator, double ratio) {
  const double cos_axis = radiator.is_omnidirectional ? 0 : dot(direction, radiator.axis);
  for (std::size_t b = 0; b < kBandCount; ++b) {
    double share = ratio;
    if (radiator.directivity[b] > 0)
      share *= emission(static_cast<double>(radiator.directivity[b]), cos_axis);
    source.power[b] = static_cast<float>(share * static_cast<double>(source.power[b]));
  }
}

}  // namespace

Source early_reflection(const Source& stored, const Vec3& probe_m, const MovingRadiator& radiator,
                        double speed_of_sound_mps) {
  Source source = stored;
  const std::uint32_t leg_code = first_leg_code_of(stored.emitter);
  const bool on_first_surface = leg_code == kOnFirstSurface;
  Vec3 surface_m(stored.position_m);
  if (!on_first_surface) {
    const FirstLeg leg = first_leg_of(leg_code);
    surface_m = probe_m + static_cast<double>(leg.distance_m) * Vec3(leg.direction);
  }
  const Vec3 path_m = surface_m - radiator.position_m;
  const double distance_m = length(path_m);
  const Vec3 direction = distance_m > 1e-6 ? path_m / distance_m : -Vec3(stored.normal);
  const double longer_m = distance_m - length(surface_m - probe_m);
  source.delay_s = std::max(0.0f, static_cast<float>(static_cast<double>(stored.delay_s) +
                                                     longer_m / speed_of_sound_mps));
  const double ratio =
      on_first_surface ? redirect(source, surface_m - probe_m, direction, distance_m) : 1;
  radiate(source, direction, radiator, ratio);
  return source;
}

Material late_reflection_material() {
  Material material;
  material.name = "late reflections";
  material.scattering = same_in_all_bands(1);
  return material;
}

Source late_reflection(const Source& stored, const MovingRadiator& radiator,
                       std::uint16_t material) {
  Source source = stored;
  source.material = material;
  if (!radiator.is_omnidirectional)
    radiate(source, Vec3(first_leg_of(first_leg_code_of(stored.emitter)).direction), radiator, 1);
  return source;
}

ProbeBounds::ProbeBounds(std::span<const Material> materials, const Air& air,
                         const LateBoost& late_boost)
    : emitters_(1),
      weights_{loudness_weights()},
      radiation_(emitters_, materials, air, late_boost) {}

std::vector<Source> ProbeBounds::bounding_sources(std::span<const Source> stored,
                                                  bool of_zone) const {
  std::vector<Source> bounding(stored.begin(), stored.end());
  for (Source& source : bounding) {
    if (of_zone) {
      source.emitter = 0;
      source.material = static_cast<std::uint16_t>(radiation_.material_count() - 1);
      continue;
    }
    const bool on_first_surface =
        first_leg_code_of(std::exchange(source.emitter, 0)) == kOnFirstSurface;
    if (!on_first_surface) continue;
    const Bands highest = radiation_.laws().peak_density(source.material);
    source.is_emitter = true;
    for (std::size_t b = 0; b < kBandCount; ++b)
      source.power[b] *= static_cast<float>(emission_power(0) * kMaxIrradianceRatio) * highest[b];
  }
  return bounding;
}

PageLoader::Fetch probe_page_fetch(const BakeFile& file, const ProbeBounds& bounds) {
  return [&](const PageEntry& entry) -> PageLoader::Content {
    try {
      auto page = file.read_page(entry);
      if (!page.ok()) return page.error();
      SourcePage bounding(bounds.radiation(), bounds.weights_by_signal(),
                          bounds.bounding_sources(page->sources, entry.of_zone));
      return std::make_unique<const ResidentPage>(entry, std::move(bounding),
                                                  std::move(page->links), file.trees(),
                                                  std::move(page->sources));
    } catch (const std::bad_alloc&) {
      return Error(file.path() + ": a page of it finds no memory; close other programs.");
    }
  };
}

}  // namespace clamor
