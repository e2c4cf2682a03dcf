#include "common/reflection.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <limits>
#include <numbers>

#include "common/maths.h"
#include "common/reflection_law-inl.h"

namespace clamor {

namespace {

namespace scalar = HWY_NAMESPACE;  // the law of reflection_law-inl.h

Vec3 around(const Vec3& axis, double cos_a, double turn) {
  const Basis basis = basis_around(axis);
  const double sin_a = std::sqrt(std::max(0.0, 1 - cos_a * cos_a));
  const double phi = 2 * std::numbers::pi * turn;
  return axis * cos_a + basis.tangent * (sin_a * cos_of(phi)) +
         basis.bitangent * (sin_a * sin_of(phi));
}

double fourth_power(double x) { return x * x * x * x; }

// Mean of clamp((a + b cos phi) / mu, 0, 1) over phi, for b >= 0 and |a| <= mu.
double ring_albedo(double a, double b, double mu) {
  if (b <= 0) return std::clamp(a / mu, 0.0, 1.0);
  const double cos_full = std::clamp((mu - a) / b, -1.0, 1.0);
  const double cos_empty = std::clamp(-a / b, -1.0, 1.0);
  const double full = acos_of(cos_full), empty = acos_of(cos_empty);  // 1 below, 0 above this phi
  const double between = a * (empty - full) + b * (std::sqrt(1 - cos_empty * cos_empty) -
                                                   std::sqrt(1 - cos_full * cos_full));
  return (full + between / mu) / std::numbers::pi;
}

// Quadrature on [0, 1]: twelve Gauss-Legendre nodes (Abramowitz and Stegun, table 25.4),
// transformed to cluster at both ends, where the integrand has its roots.
struct Rule {
  static constexpr std::size_t kNodes = 12;
  std::array<double, kNodes> at{}, weight{};
};
constexpr Rule make_rule() {
  constexpr std::array<double, Rule::kNodes / 2> kX = {0.125233408511469, 0.367831498998180,
                                                       0.587317954286617, 0.769902674194305,
                                                       0.904117256370475, 0.981560634246719};
  constexpr std::array<double, Rule::kNodes / 2> kW = {0.249147045813403, 0.233492536538355,
                                                       0.203167426723066, 0.160078328543346,
                                                       0.106939325995318, 0.047175336386512};
  Rule rule;
  for (std::size_t i = 0; i < Rule::kNodes; ++i) {
    const double t = (1 + (i % 2 == 0 ? kX[i / 2] : -kX[i / 2])) / 2;
    rule.at[i] = t * t * t * (10 - 15 * t + 6 * t * t);
    rule.weight[i] = kW[i / 2] / 2 * 30 * t * t * (1 - t) * (1 - t);
  }
  return rule;
}

// E(i) for cos i = mu, within 5e-6: the mean of [cos o > 0] min(1, cos o / cos i) over directions
// sampled from the lobe. The integral around each ring of the lobe has a closed form. The one over
// rings uses Gaussian quadrature in the share of the lobe's power outside the ring, which removes
// the exponent. The integrand is smooth except at the first ring that crosses the horizon, 90
// degrees - i from the lobe's axis, and the last ring that reaches above i, at 2 i.
double lobe_albedo(double exponent, double mu) {
  static constexpr Rule kRule = make_rule();
  const double sin_i = std::sqrt(1 - mu * mu);
  // Cosines of these two angles.
  const double sinks = sin_i, rises = std::max(2 * mu * mu - 1, 0.0);
  const std::array<double, 4> shares = {0, power(std::min(sinks, rises), exponent + 1),
                                        power(std::max(sinks, rises), exponent + 1), 1};
  double sum = 0;
  for (std::size_t piece = 0; piece < 3; ++piece) {
    const double from = shares[piece], wide = shares[piece + 1] - from;
    if (wide < 1e-12) continue;
    for (std::size_t n = 0; n < Rule::kNodes; ++n) {
      const double cos_ring = power(from + wide * kRule.at[n], 1 / (exponent + 1));
      const double sin_ring = std::sqrt(std::max(0.0, 1 - cos_ring * cos_ring));
      sum += wide * kRule.weight[n] * ring_albedo(cos_ring * mu, sin_ring * sin_i, mu);
    }
  }
  return sum;
}

// Rounds exponents to three digits, at least 0.001: half a percent is 0.02 dB of a lobe's height.
float three_digits(float exponent) {
  const double exact = std::max(static_cast<double>(exponent), 1e-3);
  double scale = 1;
  while (exact * scale < 100) scale *= 10;
  while (exact * scale >= 1000) scale /= 10;
  return static_cast<float>(std::round(exact * scale) / scale);
}

}  // namespace

PhongLobe::PhongLobe(double exponent) : exponent_(exponent) {
  assert(exponent > 0);
  for (std::size_t k = 0; k <= kCells; ++k) {
    const double root = static_cast<double>(k) / kCells;
    albedo_[k] = static_cast<float>(lobe_albedo(exponent_, std::max(root * root, 1e-9)));
  }
  min_albedo_ = *std::min_element(albedo_.begin(), albedo_.end());
  loss_slope_ = std::numeric_limits<double>::infinity();
  for (std::size_t k = 1; k <= kCells; ++k) {
    const double root = static_cast<double>(k) / kCells;
    const double lost = (1 - static_cast<double>(albedo_[k])) / (1 - min_albedo_);
    loss_slope_ = std::min(loss_slope_, -std::numbers::ln2 * log2_of(lost) / (root * root));
  }
  loss_slope_ *= 0.99;  // margin between cells

  // Trapezoidal integral of the compensation term, (1 - E) mu dmu = (1 - E) d(mu^2) / 2.
  double lost = 0;
  std::array<double, kCells + 1> cumulative{};
  for (std::size_t k = 1; k <= kCells; ++k) {
    const double low = fourth_power(static_cast<double>(k - 1) / kCells);
    const double high = fourth_power(static_cast<double>(k) / kCells);
    lost += (1 - 0.5 * (albedo_[k - 1] + albedo_[k])) * (high - low);
    cumulative[k] = lost;
  }
  mean_albedo_ = 1 - lost;
  for (std::size_t k = 0; k <= kCells; ++k)
    compensation_[k] = static_cast<float>(cumulative[k] / lost);
  for (std::size_t k = 1; k <= kCells; ++k) {
    const double low = fourth_power(static_cast<double>(k - 1) / kCells);
    const double high = fourth_power(static_cast<double>(k) / kCells);
    const auto step = static_cast<double>(compensation_[k] - compensation_[k - 1]);
    square_[k] = static_cast<float>(low);
    slope_[k] = step > 0 ? static_cast<float>((high - low) / step) : 0;
  }
  for (std::size_t j = 0, k = 1; j < kCells; ++j) {
    while (k < kCells && compensation_[k] <= static_cast<float>(j) / kCells) ++k;
    guide_[j] = static_cast<std::uint16_t>(k);
  }
}

double PhongLobe::albedo(double cos_i) const {
  const double cell = scalar::loss_cell_of<double>(cos_i, kCells);
  const auto k = std::min(static_cast<std::size_t>(cell), kCells - 1);
  return scalar::loss_between(albedo_[k], albedo_[k + 1], cell - static_cast<double>(k));
}

double PhongLobe::density(double cos_i, double cos_o, double cos_a) const {
  if (cos_o <= 0) return 0;
  return scalar::density(0.0, (exponent_ + 1) / (2 * std::numbers::pi),
                         1 / (std::numbers::pi * (1 - mean_albedo_)), cos_o,
                         scalar::tilt_of(cos_i, cos_o), power(cos_a, exponent_),
                         (1 - albedo(cos_i)) * (1 - albedo(cos_o)));
}

const PhongLobe* PhongLobes::of(const Material& material, std::size_t band) {
  if (material.scattering[band] >= 1 || material.phong[band] <= 0) return nullptr;
  const float rounded = three_digits(heard_exponent(material, band));
  std::unique_ptr<PhongLobe>& lobe = lobes_[rounded];
  if (lobe == nullptr) lobe = std::make_unique<PhongLobe>(static_cast<double>(rounded));
  return lobe.get();
}

ReflectionLaws::ReflectionLaws(std::span<const Material> materials) {
  for (const Material& material : materials) {
    Law law;
    for (std::size_t b = 0; b < kBandCount; ++b) {
      law.lobe[b] = lobes_.of(material, b);
      law.scattering[b] = law.lobe[b] != nullptr ? material.scattering[b] : 1;
      // The compensation term never exceeds Lambert's: (1 / pi) (1 - 0.5)^2 / (1 - mE) cos o, where
      // mE is at least 0.5 and the factors peak at grazing angles, where cos o is small.
      double peak = law.scattering[b] / std::numbers::pi;
      if (law.lobe[b] != nullptr)
        peak += (1 - law.scattering[b]) *
                ((law.lobe[b]->exponent() + 1) / (2 * std::numbers::pi) + 1 / std::numbers::pi);
      law.peak[b] = static_cast<float>(peak);
    }
    laws_.push_back(law);
  }
}

double ReflectionLaws::density(std::size_t material, std::size_t band, double cos_i, double cos_o,
                               double cos_a) const {
  if (cos_o <= 0) return 0;
  const Law& law = laws_[material];
  double density = law.scattering[band] * cos_o / std::numbers::pi;
  if (law.lobe[band] != nullptr)
    density += (1 - law.scattering[band]) * law.lobe[band]->density(cos_i, cos_o, cos_a);
  return density;
}

Bands ReflectionLaws::density(std::size_t material, double cos_i, double cos_o,
                              double cos_a) const {
  Bands result{};
  if (cos_o <= 0) return result;
  const Law& law = laws_[material];
  const PhongLobe* previous = nullptr;
  double lobe = 0;  // shared by bands of the same exponent
  for (std::size_t b = 0; b < kBandCount; ++b) {
    double density = law.scattering[b] * cos_o / std::numbers::pi;
    if (law.lobe[b] != nullptr) {
      if (law.lobe[b] != previous) lobe = law.lobe[b]->density(cos_i, cos_o, cos_a);
      previous = law.lobe[b];
      density += (1 - law.scattering[b]) * lobe;
    }
    result[b] = static_cast<float>(density);
  }
  return result;
}

ReflectionLaws::UpperBound ReflectionLaws::upper_bound(std::size_t material, double cos_i) const {
  const Law& law = laws_[material];
  UpperBound bound;
  bool any_lobe = false;
  const PhongLobe* previous = nullptr;
  double lost = 0;  // shared by bands of the same exponent
  for (std::size_t b = 0; b < kBandCount; ++b) {
    bound.diffuse[b] = static_cast<float>(law.scattering[b] / std::numbers::pi);
    if (const PhongLobe* const lobe = law.lobe[b]) {
      if (lobe != previous) lost = 1 - lobe->albedo(cos_i);
      previous = lobe;
      const double rest = 1 - law.scattering[b];
      bound.compensation[b] =
          static_cast<float>(rest * lost * (1 - lobe->min_albedo()) /
                             (std::numbers::pi * (1 - lobe->mean_albedo())));
      bound.lobe[b] = static_cast<float>(rest * (lobe->exponent() + 1) / (2 * std::numbers::pi));
      const auto exponent = static_cast<float>(lobe->exponent());
      const auto slope = static_cast<float>(lobe->loss_slope());
      bound.exponent = any_lobe ? std::min(bound.exponent, exponent) : exponent;
      bound.slope = any_lobe ? std::min(bound.slope, slope) : slope;
      any_lobe = true;
    }
  }
  return bound;
}

Vec3 ReflectionLaws::draw(std::size_t material, std::size_t band, const Vec3& arrival,
                          const Vec3& normal, const std::array<double, 6>& u) const {
  const Law& law = laws_[material];
  if (u[0] < law.scattering[band] || law.lobe[band] == nullptr)
    return around(normal, std::sqrt(1 - u[1]), u[2]);

  const PhongLobe& lobe = *law.lobe[band];
  const Vec3 proposal = around(mirrored(arrival, normal),
                               scalar::draw_lobe_cos(1 - u[1], 1 / (lobe.exponent() + 1)), u[2]);
  if (scalar::accepts_lobe(-dot(arrival, normal), dot(proposal, normal), u[3])) return proposal;
  return around(normal,
                static_cast<double>(
                    lobe.draw_compensation_cos(std::min(static_cast<float>(u[4]), 0x1.fffffep-1f))),
                u[5]);
}

}  // namespace clamor
