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
#include "common/maths.h"
#include "common/random.h"

namespace clamor {

namespace {

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

constexpr float kBelowOne = 0x1.fffffep-1f;

}  // namespace

double emitted_power(const Emitter& emitter, std::size_t band) {
  return emitter.gain * emitter.gain * emission_power(emitter.directivity[band]);
}

void TracedRuns::clear() {
  deposits.clear();
  photons.clear();
  runs.clear();
}

PhotonTracer::PhotonTracer(const Scene& scene, const Level& level, const TraceSettings& settings)
    : scene_(scene),
      level_(level),
      settings_(settings),
      materials_(kernel_materials(level.materials, lobes_)) {
  kernel_settings_.kappa = static_cast<float>(settings.roulette_kappa);
  kernel_settings_.longest_m = settings.longest_path_s * settings.speed_mps;
  kernel_settings_.most_bounces = settings.most_bounces;
  kernel_settings_.speed_mps = settings.speed_mps;
  kernel_settings_.offset_m = static_cast<float>(scene.offset_m());
  for (std::size_t b = 0; b < kBandCount; ++b)
    kernel_settings_.air_log2_loss_per_m[b] =
        static_cast<float>(static_cast<double>(settings.air_loss_per_m[b]) * std::numbers::log2e);

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

KernelPhoton PhotonTracer::emit(std::uint32_t index, std::uint64_t number) const {
  const Emitter& emitter = level_.emitters[index];
  KernelPhoton photon;
  photon.number = number;
  photon.key = emitter_keys_[index];
  photon.origin_m = Vec3f(emitter.position_m);

  const RandomBits bits = draw(photon.key, number, 0, Use::kEmission);
  const auto sobol = sobol_point(photon.key, static_cast<std::uint32_t>(number));
  photon.first_bounce = {std::min(static_cast<float>(sobol[2]), kBelowOne),
                         std::min(static_cast<float>(sobol[3]), kBelowOne)};

  const auto drawn = static_cast<std::size_t>(unit(bits[0]) * kBandCount);
  const double cos_a = draw_emission_cos(emitter.directivity[drawn], sobol[0]);
  const double sin_a = std::sqrt(std::max(0.0, 1 - cos_a * cos_a));
  const double turn = 2 * std::numbers::pi * sobol[1];
  const Basis basis = basis_around(emitter.axis);
  photon.direction = Vec3f(normalize(emitter.axis * cos_a + basis.tangent * (sin_a * cos_of(turn)) +
                                     basis.bitangent * (sin_a * sin_of(turn))));

  // The bands' densities towards there, ((1 + cos a) / 2)^p (p + 1) / 4 pi, as weights of sum 8.
  double sum = 0;
  std::array<double, kBandCount> density{};
  const double log2_share = cos_a > -1 ? log2_of((1 + cos_a) / 2) : -1e9;
  for (std::size_t b = 0; b < kBandCount; ++b) {
    const double p = emitter.directivity[b];
    density[b] = exp2_of(p > 0 ? p * log2_share : 0) / emission_power(p);
    sum += density[b];
  }
  for (std::size_t b = 0; b < kBandCount; ++b) {
    photon.power[b] = sum > 0 ? static_cast<float>(emitted_power(emitter, b)) : 0;
    photon.weight[b] = sum > 0 ? static_cast<float>(kBandCount * density[b] / sum) : 0;
  }
  return photon;
}

void PhotonTracer::trace(std::span<const PhotonRun> runs, TracedRuns& result) const {
  while (!runs.empty()) {
    std::size_t together = 0, photons = 0;
    while (together < runs.size() && photons + runs[together].count <= kStepPhotons)
      photons += runs[together++].count;
    assert(together > 0 && "a run has at most kRunPhotons");
    trace_together(runs.first(together), result);
    runs = runs.subspan(together);
  }
}

void PhotonTracer::trace_together(std::span<const PhotonRun> runs, TracedRuns& result) const {
  std::vector<KernelRun> kernel_runs;
  std::vector<KernelPhoton> photons;
  std::vector<std::uint16_t> alive;
  for (const PhotonRun& run : runs) {
    assert(run.emitter < level_.emitters.size());
    double launched = 0;
    for (std::size_t b = 0; b < kBandCount; ++b)
      launched += emitted_power(level_.emitters[run.emitter], b);
    KernelRun& kernel_run = kernel_runs.emplace_back();
    kernel_run.least_power = static_cast<float>(settings_.least_power * launched);
    kernel_run.emitter = run.emitter;
    kernel_run.tally.photons = run.count;
    for (std::uint32_t i = 0; i < run.count; ++i) {
      KernelPhoton photon = emit(run.emitter, run.first + i);
      photon.run = static_cast<std::uint16_t>(kernel_runs.size() - 1);
      photon.index = static_cast<std::uint16_t>(i);
      if (*std::max_element(photon.power.begin(), photon.power.end()) > 0)
        alive.push_back(static_cast<std::uint16_t>(photons.size()));
      photons.push_back(photon);
    }
  }

  const auto scratch = make_shade_scratch();
  std::vector<Ray> rays(alive.size());
  std::vector<SurfaceHit> hits(alive.size());
  std::vector<Source> deposits;
  std::vector<std::uint16_t> deposit_runs, deposit_photons;
  DepositSink sink;
  for (std::uint32_t bounce = 1; !alive.empty(); ++bounce) {
    for (std::size_t i = 0; i < alive.size(); ++i)
      rays[i] = {photons[alive[i]].origin_m, photons[alive[i]].direction};
    scene_.first_hits({rays.data(), alive.size()}, {hits.data(), alive.size()});

    const std::size_t room = sink.count + 2 * alive.size();
    if (deposits.size() < room) {
      deposits.resize(std::max(room, 2 * deposits.size()));
      deposit_runs.resize(deposits.size());
      deposit_photons.resize(deposits.size());
    }
    sink.deposits = deposits.data();
    sink.runs = deposit_runs.data();
    sink.photons = deposit_photons.data();
    alive.resize(shade(kernel_settings_, materials_, bounce, photons, alive, hits, kernel_runs,
                       *scratch, sink));
  }

  // Sorted by run; within one they are in order.
  std::vector<std::size_t> next(runs.size() + 1, 0);
  for (std::size_t i = 0; i < sink.count; ++i) ++next[deposit_runs[i] + 1];
  for (std::size_t r = 0; r < runs.size(); ++r) {
    result.runs.push_back(
        {runs[r], result.deposits.size() + next[r], next[r + 1], kernel_runs[r].tally});
    next[r + 1] += next[r];
  }
  const std::size_t first = result.deposits.size();
  result.deposits.resize(first + sink.count);
  result.photons.resize(first + sink.count);
  for (std::size_t i = 0; i < sink.count; ++i) {
    const std::size_t place = first + next[deposit_runs[i]]++;
    result.deposits[place] = deposits[i];
    result.photons[place] = deposit_photons[i];
  }
}

}  // namespace clamor
