#include "runtime/probes/probe_sources.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "common/directivity.h"
#include "runtime/propagation/loudness.h"
#include "runtime/streaming/page_fetch.h"

namespace clamor {

namespace {

// Irradiance at a surface of a source of unit power at a distance, up to a constant.
double irradiance(double cos_at_surface, double distance_m) {
  const double r_m = std::max(distance_m, kLeastDistance_m);
  return std::abs(cos_at_surface) / (r_m * r_m);
}

double irradiance_from(const Vec3& probe_to_surface_m, const Vec3& normal) {
  const double r_m = std::max(length(probe_to_surface_m), kLeastDistance_m);
  return irradiance(dot(probe_to_surface_m, normal) / r_m, r_m);
}

// Redirects a source on the first surface to sound from `arriving`, and returns its power ratio.
double redirect(Source& source, const Vec3& from_probe_m, const Vec3& arriving, double distance_m) {
  const Vec3 normal(source.normal);
  const double cos_now = dot(arriving, normal);
  // Sound that the surface transmits leaves on the far side, in its old direction. A source that
  // has passed the plane of the surface does not light this side of it.
  if (dot(from_probe_m, normal) * cos_now <= 0) return 0;
  source.mirror = Vec3f(cos_now < 0 ? arriving - 2 * cos_now * normal : arriving);
  const double at_probe = irradiance_from(from_probe_m, normal);
  return at_probe > 0 ? std::min(irradiance(cos_now, distance_m) / at_probe, kMaxIrradianceRatio)
                      : 0;
}

// Scales the power by a ratio and by the directivity towards the first surface.
void radiate(Source& source, const Vec3& direction, const MovingRadiator& radiator, double ratio) {
  const double cos_axis = dot(direction, radiator.axis);
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

double irradiance_of_probe(const Source& stored, const Vec3& probe_m) {
  return irradiance_from(Vec3(stored.position_m) - probe_m, Vec3(stored.normal));
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
  if (radiator.directivity != Bands{})
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
      source.material = late_material();
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

std::vector<SourceBound> ProbeBounds::first_reflections(std::span<const Source> stored,
                                                        bool of_zone) const {
  if (of_zone) return {};
  std::vector<SourceBound> bounds(stored.size());
  for (std::size_t s = 0; s < stored.size(); ++s) {
    if (first_leg_code_of(stored[s].emitter) != kOnFirstSurface) continue;
    // The compensation is the highest at grazing incidence.
    Source source = stored[s];
    source.mirror = Vec3f(0);
    bounds[s] = source_bound(radiation_, source, radiation_.upper_bound(source, weights()));
  }
  return bounds;
}

PageLoader::Fetch probe_page_fetch(const BakeFile& file, const ProbeBounds& bounds) {
  return page_fetch(file, [&](const PageEntry& entry, OctreePage page) {
    const std::vector<Source> bounding = bounds.bounding_sources(page.sources, entry.of_zone);
    auto reflections = bounds.first_reflections(page.sources, entry.of_zone);
    SourcePage sources(bounds.radiation(), bounds.weights_by_signal(), std::move(page.sources),
                       bounding);
    return std::make_unique<const ResidentPage>(entry, std::move(sources), std::move(page.links),
                                                file.trees(), std::move(reflections));
  });
}

}  // namespace clamor
