#include "bake/photon_tracer.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <numbers>
#include <numeric>
#include <string_view>
#include <unordered_map>

#include "bake/sobol.h"
#include "common/directivity.h"
#include "common/random.h"

namespace clamor {

namespace {

using BandValues = std::array<double, kBandCount>;

// FNV-1a.
std::uint64_t hash_of_name(std::string_view name) {
  std::uint64_t hash = 0xcbf29ce484222325u;
  for (const char c : name) hash = (hash ^ static_cast<unsigned char>(c)) * 0x100000001b3u;
  return hash;
}

RandomBits draw(std::uint64_t key, std::uint64_t photon, std::uint32_t bounce, Use use) {
  return philox(key, {static_cast<std::uint32_t>(photon), static_cast<std::uint32_t>(photon >> 32),
                      bounce, static_cast<std::uint32_t>(use)});
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

double emitted_power(const Emitter& emitter, std::size_t band) {
  return emitter.gain * emitter.gain * emission_power(emitter.directivity[band]);
}

void TracedRuns::clear() {
  deposits.clear();
  photons.clear();
  runs.clear();
}

void TraceTally::add(const TraceTally& other, double power_share) {
  photons += other.photons;
  bounces += other.bounces;
  escaped += other.escaped;
  legs_m += other.legs_m;
  legs += other.legs;
  for (std::size_t b = 0; b < kBandCount; ++b) {
    power_escaped[b] += other.power_escaped[b] * power_share;
    power_unfinished[b] += other.power_unfinished[b] * power_share;
  }
}

struct PhotonTracer::Photon {
  std::uint64_t number = 0, key = 0;
  std::uint32_t emitter = 0;
  Vec3 origin_m, direction;
  double travelled_m = 0;
  BandValues power{};                    // of the band's own paths; times weight for this path
  BandValues weight{};                   // sums to 8
  std::array<double, 2> first_bounce{};  // the Sobol point's other half
};

PhotonTracer::PhotonTracer(const Scene& scene, const Level& level, const TraceSettings& settings)
    : scene_(scene), level_(level), settings_(settings), laws_(level.materials) {
  std::unordered_map<std::string_view, std::uint32_t> namesakes;
  for (const Emitter& emitter : level.emitters) {
    const std::uint64_t name = hash_of_name(emitter.name);
    const RandomBits bits = philox(
        settings.seed, {static_cast<std::uint32_t>(name), static_cast<std::uint32_t>(name >> 32),
                        namesakes[emitter.name]++, static_cast<std::uint32_t>(Use::kEmitter)});
    emitter_keys_.push_back((std::uint64_t{bits[1]} << 32) | bits[0]);
    for (std::size_t b = 0; b < kBandCount; ++b) power_emitted_[b] += emitted_power(emitter, b);
  }
}

PhotonTracer::Photon PhotonTracer::emit(std::uint32_t index, std::uint64_t number) const {
  const Emitter& emitter = level_.emitters[index];
  Photon photon;
  photon.number = number;
  photon.key = emitter_keys_[index];
  photon.emitter = index;
  photon.origin_m = emitter.position_m;

  const RandomBits bits = draw(photon.key, number, 0, Use::kEmission);
  const auto sobol = sobol_point(photon.key, static_cast<std::uint32_t>(number));
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
    photon.power[b] = emitted_power(emitter, b);
  }
  photon.weight.fill(1);
  if (!reweight(photon.weight, density)) photon.power.fill(0);
  return photon;
}

bool PhotonTracer::reflect(Photon& photon, const Hit& hit, std::uint32_t bounce) const {
  const RandomBits first = draw(photon.key, photon.number, bounce, Use::kReflection);
  const RandomBits second = draw(photon.key, photon.number, bounce, Use::kRetry);
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

void PhotonTracer::trace(std::span<const PhotonRun> runs, TracedRuns& result) const {
  for (const PhotonRun& run : runs) trace_run(run, result);
}

void PhotonTracer::trace_run(const PhotonRun& run, TracedRuns& result) const {
  assert(run.emitter < level_.emitters.size() && run.count <= kRunPhotons);
  std::vector<std::uint32_t> bounces;  // of each deposit
  TracedRun traced{run, result.deposits.size(), 0, {}};
  TraceTally& tally = traced.tally;
  double launched = 0;
  for (std::size_t b = 0; b < kBandCount; ++b)
    launched += emitted_power(level_.emitters[run.emitter], b);
  const double least_power = settings_.least_power * launched;

  for (std::uint32_t i = 0; i < run.count; ++i) {
    const std::uint64_t number = run.first + i;
    Photon photon = emit(run.emitter, number);
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

      const RandomBits bits = draw(photon.key, number, bounce, Use::kPolarity);
      deposit.position_m = Vec3f(hit->point_m);
      deposit.normal = Vec3f(hit->normal);
      deposit.mirror = Vec3f(mirrored(photon.direction, hit->normal));
      deposit.delay_s = static_cast<float>(delay_s);
      deposit.u = static_cast<float>(unit_above_zero(bits[0]));
      deposit.polarity = (bits[1] & 1) != 0 ? 1 : -1;
      deposit.emitter = photon.emitter;
      deposit.material = hit->material;
      double summed = 0;
      for (const float band : deposit.power) summed += static_cast<double>(band);
      if (summed >= least_power || unit(bits[3]) * least_power < summed) {
        const double scale = std::max(1.0, least_power / summed);
        for (float& band : deposit.power) band = static_cast<float>(band * scale);
        result.deposits.push_back(deposit);
        result.photons.push_back(static_cast<std::uint16_t>(i));
        bounces.push_back(bounce);
      }

      const double survival = std::pow(std::min(1.0, after / before), settings_.roulette_kappa);
      if (unit(bits[2]) >= survival) break;
      for (double& power : photon.power) power /= survival;
      if (!reflect(photon, *hit, bounce)) break;
    }
  }

  // By bounce; photons are in order already.
  traced.deposits = bounces.size();
  std::vector<std::size_t> order(bounces.size());
  std::iota(order.begin(), order.end(), 0);
  std::stable_sort(order.begin(), order.end(),
                   [&](std::size_t a, std::size_t b) { return bounces[a] < bounces[b]; });
  std::vector<Source> deposits;
  std::vector<std::uint16_t> photons;
  for (const std::size_t i : order) {
    deposits.push_back(result.deposits[traced.first_deposit + i]);
    photons.push_back(result.photons[traced.first_deposit + i]);
  }
  const auto first = static_cast<std::ptrdiff_t>(traced.first_deposit);
  std::copy(deposits.begin(), deposits.end(), result.deposits.begin() + first);
  std::copy(photons.begin(), photons.end(), result.photons.begin() + first);
  result.runs.push_back(traced);
}

}  // namespace clamor
