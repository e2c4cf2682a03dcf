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

// Redirects a first reflection of sound from a place `path_m` before it to sound from `arriving`.
// Returns its power ratio.
double redirect(Source& source, const Vec3& path_m, const Vec3& arriving, double distance_m) {
  const Vec3 normal(source.normal);
  const double cos_now = dot(arriving, normal);
  // Sound that the surface transmits leaves on the far side, in its old direction. A source that
  // has passed the plane of the surface does not light this side of it.
  if (dot(path_m, normal) * cos_now <= 0) return 0;
  source.mirror = Vec3f(cos_now < 0 ? arriving - 2 * cos_now * normal : arriving);
  const double before = irradiance_from(path_m, normal);
  return before > 0 ? std::min(irradiance(cos_now, distance_m) / before, kMaxIrradianceRatio) : 0;
}

// The path from a moving source to its first surface.
struct FirstPath {
  FirstPath(const Vec3& surface_m, const Source& source, const MovingRadiator& radiator) {
    const Vec3 path_m = surface_m - radiator.position_m;
    distance_m = length(path_m);
    direction = distance_m > 1e-6 ? path_m / distance_m : -Vec3(source.normal);
  }
  double distance_m = 0;
  Vec3 direction{};
};

void lengthen(Source& source, double longer_m, double speed_of_sound_mps) {
  source.delay_s = std::max(0.0f, static_cast<float>(static_cast<double>(source.delay_s) +
                                                     longer_m / speed_of_sound_mps));
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
  const FirstLeg leg = first_leg_of(stored.path.first_leg);
  const Vec3 leg_m = static_cast<double>(leg.distance_m) * Vec3(leg.direction);
  const FirstPath path(probe_m + leg_m, source, radiator);
  lengthen(source, path.distance_m - length(leg_m), speed_of_sound_mps);
  radiate(source, path.direction, radiator, 1);
  return source;
}

Source first_reflection(const Source& stored, const Vec3& from_m, const MovingRadiator& radiator,
                        double speed_of_sound_mps) {
  Source source = stored;
  const Vec3 before_m = Vec3(stored.position_m) - from_m;
  const FirstPath path(Vec3(stored.position_m), source, radiator);
  lengthen(source, path.distance_m - length(before_m), speed_of_sound_mps);
  const double ratio = redirect(source, before_m, path.direction, path.distance_m);
  radiate(source, path.direction, radiator, ratio);
  return source;
}

double irradiance_from(const Vec3& to_surface_m, const Vec3& normal) {
  const double r_m = std::max(length(to_surface_m), kLeastDistance_m);
  return irradiance(dot(to_surface_m, normal) / r_m, r_m);
}

Material late_reflection_material() { return diffuse_material("late reflections"); }

Source late_reflection(const Source& stored, const MovingRadiator& radiator,
                       std::uint16_t material) {
  Source source = stored;
  source.material = material;
  if (radiator.directivity != Bands{})
    radiate(source, Vec3(first_leg_of(stored.path.first_leg).direction), radiator, 1);
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
    source.emitter = 0;
    if (of_zone) source.material = late_material();
  }
  return bounding;
}

PageLoader::Fetch probe_page_fetch(const BakeFile& file, const ProbeBounds& bounds) {
  return page_fetch(file, [&](const PageEntry& entry, OctreePage page) {
    const std::vector<Source> bounding = bounds.bounding_sources(page.sources, entry.of_zone);
    SourcePage sources(bounds.radiation(), bounds.weights_by_signal(), std::move(page.sources),
                       bounding);
    return std::make_unique<const ResidentPage>(entry, std::move(sources), std::move(page.links),
                                                file.trees());
  });
}

}  // namespace clamor
