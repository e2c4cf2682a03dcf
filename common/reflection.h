// reflection.h: the BRDF of surfaces, reference evaluation and sampling.
//
// Per band, a share s of the reflected power follows Lambert's law and the rest the paper's Phong
// lobe cos^p(a), a the angle to the mirror direction, made reciprocal and energy conserving:
//
//   f = s/pi + (1-s) [ (p+1)/2pi cos^p(a) / max(cos i, cos o) + (1-E(i))(1-E(o)) / (pi (1-mE)) ]
//
// i and o are the angles of incidence and departure. E(i), the albedo of the lobe, is the share of
// its power above the surface, and mE = 2 int E(mu) mu dmu is its mean. The second term
// compensates, diffusely, for what the lobe loses below the surface. The uncorrected lobe is not
// reciprocal and does not preserve a diffuse field, which makes decay times wrong by up to 8 %.
//
// An exponent of 0 means Lambert. For mirrors these are the laws by which the last reflection is
// heard (material.h); photons are reflected in exactly the mirror direction. Densities are per
// steradian of departure, cos o included, and relative to the reflected power; absorption is
// applied by the caller. reflection_law-inl.h holds its formulas, reflection_table.h its
// coefficients for kernels.
#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <unordered_map>
#include <vector>

#include "common/bands.h"
#include "common/material.h"
#include "common/vec.h"

namespace clamor {

// Precomputed tables of one exponent p > 0. Construction takes 0.7 ms, memory 5 kB.
class PhongLobe {
 public:
  explicit PhongLobe(double exponent);

  double exponent() const { return exponent_; }

  // E(i), within 2e-4 of the integral of the lobe over the hemisphere.
  double albedo(double cos_i) const;
  double mean_albedo() const { return mean_albedo_; }
  double min_albedo() const { return min_albedo_; }
  // Slope of the bound 1 - E(o) <= (1 - min_albedo()) exp(-loss_slope() cos o): 0.34 for an
  // exponent of 1, 1.7 for 20, 3.8 for 100.
  double loss_slope() const { return loss_slope_; }

  // Density of departure per steradian, cos o included. Zero below the surface. Integrates to 1.
  double density(double cos_i, double cos_o, double cos_a) const;

  // Samples cos o from the compensation term, with density (1 - E(mu)) mu, from a uniform number in
  // [0, 1).
  float draw_compensation_cos(float u) const {
    std::size_t k = guide_[static_cast<std::size_t>(u * kCells)];
    while (k < kCells && compensation_[k] <= u) ++k;
    return std::sqrt(square_[k] + (u - compensation_[k - 1]) * slope_[k]);
  }

 private:
  static constexpr std::size_t kCells = 256;  // cells in sqrt(mu), which resolves grazing angles

  double exponent_;
  double mean_albedo_ = 0, min_albedo_ = 0, loss_slope_ = 0;
  std::array<float, kCells + 1> albedo_{};        // at mu = (k / kCells)^2
  std::array<float, kCells + 1> compensation_{};  // cumulative share below that mu
  std::array<float, kCells + 1> square_{};        // mu^2 at the start of cell k,
  std::array<float, kCells + 1> slope_{};         // and its increase per cumulative share
  std::array<std::uint16_t, kCells> guide_{};     // first cell to search for u = j / kCells
};

// The lobes of all materials, shared by exponent. Exponents are rounded to three digits (0.02 dB of
// the lobe's height) and at least 0.001, so there are at most 5401.
class PhongLobes {
 public:
  // The lobe of a material's specular share, or null if it is fully diffuse. Valid as long as this
  // object.
  const PhongLobe* of(const Material& material, std::size_t band);
  std::size_t count() const { return lobes_.size(); }

 private:
  std::unordered_map<float, std::unique_ptr<PhongLobe>> lobes_;
};

// The BRDFs of a level's materials. Immutable, so any thread may call it.
class ReflectionLaws {
 public:
  explicit ReflectionLaws(std::span<const Material> materials);

  // Density of departure per steradian and band, given the cosines of incidence and departure and
  // the cosine of the angle to the mirror direction.
  Bands density(std::size_t material, double cos_i, double cos_o, double cos_a) const;

  // Upper bound of density() per band over all directions of incidence and departure.
  Bands peak_density(std::size_t material) const { return laws_[material].peak; }

  // Upper bound of density() over all departures for a given incidence:
  //
  //   density_b <= (diffuse_b + compensation_b exp(-slope cos o)) cos o + lobe_b cos^p(a),
  //
  // where p = exponent and slope are the minima over the bands' lobes.
  struct UpperBound {
    Bands diffuse{}, compensation{}, lobe{};
    float exponent = 0, slope = 0;
  };
  UpperBound upper_bound(std::size_t material, double cos_i) const;

  // Lambert's share, and the lobe of the remaining share (null if that is 0).
  float scattering(std::size_t material, std::size_t band) const {
    return laws_[material].scattering[band];
  }
  const PhongLobe* lobe(std::size_t material, std::size_t band) const {
    return laws_[material].lobe[band];
  }

  std::size_t lobe_count() const { return lobes_.count(); }

  // Samples a departure from one band's BRDF with six uniform numbers in [0, 1). `arrival` points
  // towards the surface, `normal` away from it on the same side; both are unit vectors.
  Vec3 draw(std::size_t material, std::size_t band, const Vec3& arrival, const Vec3& normal,
            const std::array<double, 6>& u) const;

  // density() of a single band.
  double density(std::size_t material, std::size_t band, double cos_i, double cos_o,
                 double cos_a) const;

 private:
  struct Law {
    std::array<float, kBandCount> scattering{};
    std::array<const PhongLobe*, kBandCount> lobe{};  // null for a fully diffuse band
    Bands peak{};
  };

  PhongLobes lobes_;
  std::vector<Law> laws_;
};

// The mirror direction of a unit vector that arrives at a surface.
inline Vec3 mirrored(const Vec3& arrival, const Vec3& normal) {
  return arrival - 2 * dot(arrival, normal) * normal;
}

}  // namespace clamor
