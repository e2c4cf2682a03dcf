// reflection.h: where a surface sends the sound that hits it.
//
// Per band, a share s of the reflected power leaves by Lambert's law and the rest by the paper's
// Phong lobe cos^p(a), a the angle to the mirror direction, made reciprocal and exact in energy:
//
//   f = s/pi + (1-s) [ (p+1)/2pi cos^p(a) / max(cos i, cos o) + (1-E(i))(1-E(o)) / (pi (1-mE)) ]
//
// i and o are the angles of arrival and departure to the normal; E(i), the lobe's albedo, is the
// share of its power that survives above the surface; mE = 2 int E(mu) mu dmu is its mean. The
// second term gives back, diffusely, what the lobe loses below the surface. The naive lobe keeps
// neither reciprocity nor a diffuse field, and decay times come out up to 8 % wrong.
//
// An exponent of 0 means Lambert. Everything here is a density per steradian of departure, of
// what is reflected: absorption is the caller's.
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

// The tables of one exponent p > 0. Costs 0.7 ms to make, 5 kB to keep.
class PhongLobe {
 public:
  explicit PhongLobe(double exponent);

  double exponent() const { return exponent_; }

  // E(i), within 2e-4 of the integral of the lobe over the hemisphere.
  double albedo(double cos_i) const;
  double mean_albedo() const { return mean_albedo_; }
  double min_albedo() const { return least_albedo_; }
  // 1 - E(o) <= (1 - min_albedo()) exp(-loss_slope() cos o): 0.34 for an exponent of 1, 1.7 for
  // 20, 3.8 for 100.
  double loss_slope() const { return loss_slope_; }

  // Density of departure per steradian, cos o included. Zero below the surface. Integrates to 1.
  double density(double cos_i, double cos_o, double cos_a) const;

  // The cosine to the normal of a departure under the second term: density (1 - E(mu)) mu.
  float draw_compensation_cos(float u) const {  // u in [0, 1)
    std::size_t k = guide_[static_cast<std::size_t>(u * kCells)];
    while (k < kCells && compensation_[k] <= u) ++k;
    return std::sqrt(square_[k] + (u - compensation_[k - 1]) * slope_[k]);
  }

 private:
  static constexpr std::size_t kCells = 256;  // in sqrt(mu), so that grazing angles are resolved

  double exponent_;
  double mean_albedo_ = 0, least_albedo_ = 0, loss_slope_ = 0;
  std::array<float, kCells + 1> albedo_{};        // at mu = (k / kCells)^2
  std::array<float, kCells + 1> compensation_{};  // cumulative share below that mu
  std::array<float, kCells + 1> square_{};        // of mu where cell k begins,
  std::array<float, kCells + 1> slope_{};         // and how it grows with that share
  std::array<std::uint16_t, kCells> guide_{};     // the first cell to look in, for u = j / kCells
};

// A lobe for each exponent of some materials, to three digits (0.02 dB of its height) and from a
// thousandth on: so however many materials a level has, it has no more than 5401.
class PhongLobes {
 public:
  // What a material reflects by what it does not scatter; null if it scatters all. Valid as long as
  // these.
  const PhongLobe* of(const Material& material, std::size_t band);
  std::size_t count() const { return lobes_.size(); }

 private:
  std::unordered_map<float, std::unique_ptr<PhongLobe>> lobes_;
};

// What a level's materials are to reflect by.
class ReflectionLaws {
 public:
  explicit ReflectionLaws(std::span<const Material> materials);

  // Density of departure per steradian and band for power reflected off `material`: cos i, cos o
  // to the normal, cos a to the mirror direction.
  Bands density(std::size_t material, double cos_i, double cos_o, double cos_a) const;

  // The highest value density() can take in any direction, per band, whatever the arrival.
  Bands peak_density(std::size_t material) const { return laws_[material].peak; }

  // What density() cannot exceed towards any direction, once the arrival is known:
  //
  //   density_b <= (diffuse_b + bounce_b exp(-slope cos o)) cos o + lobe_b cos^p(a),
  //
  // p = exponent and slope the least of the lobes'.
  struct Ceiling {
    Bands diffuse{}, bounce{}, lobe{};
    float exponent = 0, slope = 0;
  };
  Ceiling ceiling(std::size_t material, double cos_i) const;

  // What density() is made of: Lambert's share, and the lobe of the rest; null where that is 0.
  float scattering(std::size_t material, std::size_t band) const {
    return laws_[material].scattering[band];
  }
  const PhongLobe* lobe(std::size_t material, std::size_t band) const {
    return laws_[material].lobe[band];
  }

  std::size_t lobe_count() const { return lobes_.count(); }

  // Draws a departure for one band's law from six uniforms in [0, 1). `arrival` points at the
  // surface, `normal` to the side it came from; both unit vectors.
  Vec3 draw(std::size_t material, std::size_t band, const Vec3& arrival, const Vec3& normal,
            const std::array<double, 6>& u) const;

  // The same law as density(), for the band's share alone.
  double density(std::size_t material, std::size_t band, double cos_i, double cos_o,
                 double cos_a) const;

 private:
  struct Law {
    std::array<float, kBandCount> scattering{};
    std::array<const PhongLobe*, kBandCount> lobe{};  // null where the band is all Lambert
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
