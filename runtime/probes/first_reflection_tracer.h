// first_reflection_tracer.h: traces the first reflections of a source of sound from its own place.
//
// Rays leave the source in directions that cover the sphere evenly, turned at random for each
// source. Where one first meets a surface of the level it leaves a secondary source, with the power
//
//   4 pi / N (1 - absorption) exp(-m r)
//
// per band, N the number of rays, m the attenuation of the air and r the length of the ray. Where
// the surface is thin (thin_material.h), another one on its far side has `transmission` in place of
// 1 - absorption. Parts absorb all sound.
//
// A source's 252 rays are in six sets, each of which covers the sphere by itself, so that a source
// that moves can trace a set at a time.
//
// A ray stands for a cone of 14 degrees. Where the patch of a surface that it illuminates has a
// radius of more than a quarter of the listener's distance, the cone is divided among 16 rays, and
// each of these likewise once more: otherwise a listener near a surface would hear it through one
// ray or none. Over 24 draws of the directions, early reflections at a place in Sponza, 1 m from a
// column and 10 m from the source, spread by 0.2 dB instead of 0.5 dB, and above the stands of a
// stadium by 0.4 instead of 1.6 dB, with a bias of -0.7 instead of -1.9 dB. Dividing only within
// half that distance leaves twice the spread, and 11 % too little half a metre above a floor.
//
// Threads: any, while no part moves.   Cost: half a microsecond per ray.
#pragma once

#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>
#include <span>
#include <vector>

#include "common/air.h"
#include "common/bands.h"
#include "common/material.h"
#include "common/vec.h"
#include "formats/bake_file/source.h"
#include "formats/level/portal.h"

namespace clamor {

class OcclusionGeometry;

struct FirstReflection {
  Source source;             // its emitter is 0
  PortalSet portals;         // that the ray passed
  std::uint32_t number = 0;  // of the ray, and of the side of the surface; below kNumbers
  // How many of the kRays rays it stands for, if a mirror reflects it and no portal is on its way;
  // otherwise 0.
  float mirrored_rays = 0;
};

class FirstReflectionTracer {
 public:
  static constexpr std::uint32_t kSets = 6, kRaysOfSet = 42, kRays = kSets * kRaysOfSet;
  static constexpr std::uint32_t kDivision = 16;  // rays of a cone that is divided
  // Rays with lower numbers may be divided: those of the sphere, and their parts.
  static constexpr std::uint32_t kLastDivided = kRays * (1 + kDivision);
  static constexpr std::uint32_t kNumbers = 2 * (kRays + kLastDivided * kDivision);

  // `surfaces` and `portals` must outlive the object.
  FirstReflectionTracer(const OcclusionGeometry& surfaces, std::span<const Material> materials,
                        const Air& air, std::span<const Portal> portals);

  // Appends the reflections of a set of rays, each with its share of all kRays. `key` selects the
  // directions and the random numbers of the source.
  struct Traced {
    std::size_t rays = 0;
    double nearest_m = std::numeric_limits<double>::infinity();  // distance of the nearest surface
  };
  Traced trace(const Vec3& place_m, const Vec3& listener_m, std::uint64_t key, std::uint32_t set,
               std::vector<FirstReflection>& reflections) const;

  // The share of the reflected power that a material scatters, and the share of the power that it
  // reflects as a mirror, in its loudest band.
  const Bands& scattering(std::size_t material) const { return by_material_[material].scattering; }
  float mirrored(std::size_t material) const { return by_material_[material].mirrored; }

 private:
  struct Surface {
    Bands reflected{}, transmitted{};  // shares of the power
    Bands scattering{};                // of what is reflected
    float mirrored = 0;
    bool transmits = false;
  };

  struct Ray {
    Vec3 direction{};
    double share = 0;  // of the source's power
    std::uint32_t number = 0;
  };
  struct Hit {
    Vec3 point_m{}, normal{};  // the normal is on the side of incidence
    double distance_m = 0, cos_i = 0, patch_radius_m = 0;
    std::uint16_t material = 0;
  };
  static Vec3 divided_direction(const Ray& ray, std::uint32_t part);
  std::optional<Hit> first_hit(const Vec3& place_m, const Ray& ray) const;
  void add(const Vec3& place_m, std::uint64_t key, const Ray& ray, const Hit& hit,
           std::vector<FirstReflection>& reflections) const;

  const OcclusionGeometry& surfaces_;
  std::vector<Surface> by_material_;
  Bands loss_per_m_;
  double speed_of_sound_mps_;
  std::span<const Portal> portals_;
};

}  // namespace clamor
