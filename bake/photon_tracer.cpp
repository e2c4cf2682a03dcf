#include "bake/photon_tracer.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <numbers>

#include "bake/sobol.h"
#include "common/directivity.h"
#include "common/random.h"

namespace clamor {

namespace {

using BandValues = std::array<double, kBandCount>;

double emitted_power(const Emitter& emitter, std::size_t band) {
  return emitter.gain * emitter.gain * emission_power(emitter.directivity[band]);
}

// Which band's law draws the next direction: one with share w[b] of the sum 8.
std::size_t draw_band(const BandValues& w, double u) {
  double left = u * kBandCount;
  for (std::size_t b = 0; b + 1 < kBandCount; ++b) {
    left -= w[b];
    if (left < 0) return b;
  }
  return kBandCount - 1;
}

// w <- 8 w q / sum(w q). False when no band could have come this way.
bool reweight(BandValues& w, const BandValues& q) {
  double sum = 0;
  for (std::size_t b = 0; b < kBandCount; ++b) sum += w[b] * q[b];
  if (!(sum > 0)) return false;
  for (std::size_t b = 0; b < kBandCount; ++b) w[b] *= kBandCount * q[b] / sum;
  return true;
}

}  // namespace

void TraceTally::add(const TraceTally& other) {
  photons += other.photons;
  bounces += other.bounces;
  escaped += other.escaped;
  legs_m += other.legs_m;
  legs += other.legs;
  for (std::size_t b = 0; b < kBandCount; ++b) {
    power_escaped[b] += other.power_escaped[b];
    power_unfinished[b] += other.power_unfinished[b];
  }
}

struct PhotonTracer::Photon {
  std::uint64_t number = 0;
  std::uint32_t emitter = 0;
  Vec3 origin_m, direction;
  double travelled_m = 0;
  BandValues power{};                    // of the band's own paths; times weight for this path
  BandValues weight{};                   // sums to 8
  std::array<double, 2> first_bounce{};  // the Sobol point's other half
};

PhotonTracer::PhotonTracer(const Scene& scene, const Level& level, const TraceSettings& settings)
    : scene_(scene), level_(level), settings_(settings), laws_(level.materials) {
  // Photons are shared out by power, summed over bands: photon i belongs to the emitter at
  // (i + u) / N of the cumulative power. Unbiased however few there are per emitter, since a photon
  // carries its emitter's power over the expected number, not the actual one.
  emitter_share_.push_back(0);
  double total = 0;
  for (const Emitter& emitter : level.emitters) {
    for (std::size_t b = 0; b < kBandCount; ++b) {
      const double power = emitted_power(emitter, b);
      power_emitted_[b] += power;
      total += power;
    }
    emitter_share_.push_back(total);
  }
  for (double& share : emitter_share_) share = total > 0 ? share / total : 0;
  first_u_ = unit(philox(settings.seed, {0, 0, 0, static_cast<std::uint32_t>(Use::kEmission)})[3]);
}

PhotonTracer::Photon PhotonTracer::emit(std::uint64_t number) const {
  const auto count = static_cast<double>(settings_.photons);
  const double place = (static_cast<double>(number) + first_u_) / count;
  const auto above = std::upper_bound(emitter_share_.begin() + 1, emitter_share_.end() - 1, place);
  const auto index = static_cast<std::size_t>(above - emitter_share_.begin()) - 1;
  const Emitter& emitter = level_.emitters[index];
  const double expected_photons = (emitter_share_[index + 1] - emitter_share_[index]) * count;
  const double first_of_emitter = std::ceil(emitter_share_[index] * count - first_u_);

  Photon photon;
  photon.number = number;
  photon.emitter = static_cast<std::uint32_t>(index);
  photon.origin_m = emitter.position_m;

  const auto low = static_cast<std::uint32_t>(number),
             high = static_cast<std::uint32_t>(number >> 32);
  const RandomBits bits =
      philox(settings_.seed, {low, high, 0, static_cast<std::uint32_t>(Use::kEmission)});
  const RandomBits emitter_key =
      philox(settings_.seed, {photon.emitter, 0, 0xffffffffu,  // a bounce no photon reaches
                              static_cast<std::uint32_t>(Use::kEmission)});
  const auto sobol =
      sobol_point((std::uint64_t{emitter_key[0]} << 32) | emitter_key[1],
                  static_cast<std::uint32_t>(static_cast<double>(number) - first_of_emitter));
  photon.first_bounce = {sobol[2], sobol[3]};

  const std::size_t drawn =
      std::min<std::size_t>(static_cast<std::size_t>(unit(bits[0]) * kBandCount), kBandCount - 1);
  const double cos_a = draw_emission_cos(emitter.directivity[drawn], sobol[0]);
  const double sin_a = std::sqrt(std::max(0.0, 1 - cos_a * cos_a));
  const double turn = 2 * std::numbers::pi * sobol[1];
  const Basis basis = basis_around(emitter.axis);
  photon.direction = normalize(emitter.axis * cos_a + basis.tangent * (sin_a * std::cos(turn)) +
                               basis.bitangent * (sin_a * std::sin(turn)));

  BandValues density;
  for (std::size_t b = 0; b < kBandCount; ++b) {
    density[b] = emission(emitter.directivity[b], cos_a) / emission_power(emitter.directivity[b]);
    photon.power[b] = emitted_power(emitter, b) / expected_photons;
  }
  photon.weight.fill(1);
  if (!reweight(photon.weight, density)) photon.power.fill(0);
  return photon;
}

bool PhotonTracer::reflect(Photon& photon, const Hit& hit, std::uint32_t bounce) const {
  const auto low = static_cast<std::uint32_t>(photon.number);
  const auto high = static_cast<std::uint32_t>(photon.number >> 32);
  const RandomBits first =
      philox(settings_.seed, {low, high, bounce, static_cast<std::uint32_t>(Use::kReflection)});
  const RandomBits second =
      philox(settings_.seed, {low, high, bounce, static_cast<std::uint32_t>(Use::kRetry)});
  std::array<double, 6> u = {unit(first[0]),  unit(first[1]),  unit(first[2]),
                             unit(second[0]), unit(second[1]), unit(second[2])};
  if (bounce == 1) {
    u[1] = photon.first_bounce[0];
    u[2] = photon.first_bounce[1];
  }

  const std::size_t drawn = draw_band(photon.weight, unit(first[3]));
  const Vec3 mirror = mirrored(photon.direction, hit.normal);
  const Vec3 departure =
      normalize(laws_.draw(hit.material, drawn, photon.direction, hit.normal, u));
  const double cos_i = -dot(photon.direction, hit.normal);
  const double cos_o = dot(departure, hit.normal);
  const Bands density = laws_.density(hit.material, cos_i, cos_o, dot(departure, mirror));
  BandValues q;
  std::copy(density.begin(), density.end(), q.begin());
  if (!reweight(photon.weight, q)) return false;

  photon.direction = departure;
  photon.origin_m = scene_.away_from_surface(hit.point_m, hit.normal);
  return true;
}

void PhotonTracer::trace(std::uint64_t first, std::uint64_t count, std::vector<Source>& deposits,
                         TraceTally& tally) const {
  assert(first + count <= settings_.photons);
  for (std::uint64_t number = first; number < first + count; ++number) {
    Photon photon = emit(number);
    ++tally.photons;

    for (std::uint32_t bounce = 1;; ++bounce) {
      double before = 0;
      for (std::size_t b = 0; b < kBandCount; ++b)
        before = std::max(before, photon.power[b] * photon.weight[b]);
      if (!(before > 0)) break;

      const auto hit = scene_.intersect(photon.origin_m, photon.direction);
      if (!hit) {
        ++tally.escaped;
        for (std::size_t b = 0; b < kBandCount; ++b)
          tally.power_escaped[b] += photon.power[b] * photon.weight[b];
        break;
      }
      photon.travelled_m += hit->distance_m;
      const double delay_s = photon.travelled_m / settings_.speed_mps;
      if (delay_s > settings_.longest_path_s || bounce > settings_.most_bounces) {
        for (std::size_t b = 0; b < kBandCount; ++b)
          tally.power_unfinished[b] += photon.power[b] * photon.weight[b];
        break;
      }
      ++tally.bounces;
      if (bounce > 1) {
        tally.legs_m += hit->distance_m;
        ++tally.legs;
      }

      const Material& material = level_.materials[hit->material];
      double after = 0;
      Source deposit;
      for (std::size_t b = 0; b < kBandCount; ++b) {
        photon.power[b] *= std::exp(-settings_.air_loss_per_m[b] * hit->distance_m) *
                           (1 - static_cast<double>(material.absorption[b]));
        const double reflected = photon.power[b] * photon.weight[b];
        after = std::max(after, reflected);
        deposit.power[b] = static_cast<float>(reflected);
      }
      if (!(after > 0)) break;

      const RandomBits bits =
          philox(settings_.seed,
                 {static_cast<std::uint32_t>(number), static_cast<std::uint32_t>(number >> 32),
                  bounce, static_cast<std::uint32_t>(Use::kPolarity)});
      deposit.position_m = Vec3f(hit->point_m);
      deposit.normal = Vec3f(hit->normal);
      deposit.mirror = Vec3f(mirrored(photon.direction, hit->normal));
      deposit.delay_s = static_cast<float>(delay_s);
      deposit.u = static_cast<float>(unit_above_zero(bits[0]));
      deposit.polarity = (bits[1] & 1) != 0 ? 1 : -1;
      deposit.emitter = photon.emitter;
      deposit.material = hit->material;
      deposits.push_back(deposit);

      const double survival = std::pow(std::min(1.0, after / before), settings_.roulette_kappa);
      if (unit(bits[2]) >= survival) break;
      for (double& power : photon.power) power /= survival;
      if (!reflect(photon, *hit, bounce)) break;
    }
  }
}

}  // namespace clamor
