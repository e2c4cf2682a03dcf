#include "bake/trace/photon_tracer.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <numbers>
#include <string_view>
#include <unordered_map>
#include <utility>

#include "bake/trace/sobol.h"
#include "common/directivity.h"
#include "common/maths.h"
#include "common/object_pool.h"
#include "common/random.h"
#include "formats/level/level.h"

namespace clamor {

// Buffers of a batch, kept for the next.
struct TraceWorkspace {
  std::vector<KernelRun> runs;
  std::vector<KernelPhoton> photons;
  std::vector<std::uint16_t> alive;
  std::vector<Ray> rays;
  std::vector<SurfaceHit> hits;
  std::vector<std::uint32_t> run_ends;                  // in photons
  std::vector<Bands> emitted;                           // by a photon of each run
  std::vector<std::array<double, kBandCount>> arrived;  // by run and material
  std::unique_ptr<ShadeScratch, DeleteScratch> scratch = make_shade_scratch();
};

namespace {

// FNV-1a hash.
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

double emitted_power(const Emitter& emitter) {
  double power = 0;
  for (std::size_t b = 0; b < kBandCount; ++b) power += emitted_power(emitter, b);
  return power;
}

void TracedRuns::clear() {
  runs_.clear();
  count_ = 0;
  paths_.nodes.clear();
  paths_.tallies.clear();
}

void TracedRuns::append(const PhotonRun& run, const TraceTally& tally,
                        std::span<const Deposit> deposits, std::vector<ArrivedPower> arrived) {
  make_room(count_ + deposits.size());
  std::copy(deposits.begin(), deposits.end(),
            deposits_.begin() + static_cast<std::ptrdiff_t>(count_));
  runs_.push_back({run, count_, deposits.size(), tally, std::move(arrived)});
  count_ += deposits.size();
}

void TracedRuns::make_room(std::size_t deposits) {
  if (deposits_.size() >= deposits) return;
  deposits_.resize(std::max(deposits, 2 * deposits_.size()));
  run_of_.resize(deposits_.size());
  if (records_paths_) paths_.deposits.resize(deposits_.size());
}

// Deposits of runs traced together are ordered by bounce; this groups them by run.
void TracedRuns::sort_by_run(std::size_t first_deposit, std::size_t first_run) {
  const std::size_t runs = runs_.size() - first_run;
  std::vector<std::size_t> next(runs + 1, 0);
  for (std::size_t i = first_deposit; i < count_; ++i) ++next[run_of_[i] + 1u];
  for (std::size_t r = 0; r < runs; ++r) {
    runs_[first_run + r].deposits = next[r + 1];
    next[r + 1] += next[r];
    runs_[first_run + r].first_deposit = first_deposit + next[r];
  }
  if (runs == 1) return;
  const auto begin = static_cast<std::ptrdiff_t>(first_deposit);
  const auto end = static_cast<std::ptrdiff_t>(count_);
  const std::vector<Deposit> deposits(deposits_.begin() + begin, deposits_.begin() + end);
  std::vector<std::uint32_t> nodes;
  if (records_paths_) nodes.assign(paths_.deposits.begin() + begin, paths_.deposits.begin() + end);
  for (std::size_t i = 0; i < deposits.size(); ++i) {
    const std::size_t to = first_deposit + next[run_of_[first_deposit + i]]++;
    deposits_[to] = deposits[i];
    if (records_paths_) paths_.deposits[to] = nodes[i];
  }
}

PhotonTracer::PhotonTracer(const Scene& scene, const Level& level, const TraceSettings& settings)
    : scene_(scene),
      level_(level),
      settings_(settings),
      portals_(level.portals, scene.offset_m()),
      laws_(level.materials),
      materials_(kernel_materials(level.materials, laws_)),
      workspaces_(std::make_shared<ObjectPool<TraceWorkspace>>()) {
  kernel_settings_.roulette_exponent = static_cast<float>(settings.roulette_exponent);
  kernel_settings_.max_path_m = settings.longest_path_s * settings.speed_mps;
  kernel_settings_.fade_m = settings.fade_s * settings.speed_mps;
  kernel_settings_.max_bounces = settings.max_bounces;
  kernel_settings_.seconds_per_m = 1 / settings.speed_mps;
  kernel_settings_.deposit_weight = DepositWeight(settings.decay);
  kernel_settings_.images = settings_.images.get();
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

KernelPhoton PhotonTracer::emit(std::uint32_t index, std::uint64_t number, Ray& ray) const {
  const Emitter& emitter = level_.emitters[index];
  KernelPhoton photon;
  photon.number = number;
  photon.key = emitter_keys_[index];
  photon.portals = settings_.first_portals;
  ray.origin_m = Vec3f(emitter.position_m);

  const RandomBits bits = draw(photon.key, number, 0, Use::kEmission);
  const auto sobol = sobol_point(photon.key, static_cast<std::uint32_t>(number));
  photon.first_bounce = {std::min(static_cast<float>(sobol[2]), kBelowOne),
                         std::min(static_cast<float>(sobol[3]), kBelowOne)};

  // Same as draw_emission_cos() of common/directivity.h, in single precision.
  const auto drawn = static_cast<std::size_t>(unit(bits[0]) * kBandCount);
  const float p = emitter.directivity[drawn];
  const float u = std::max(static_cast<float>(sobol[0]), 0x1p-32f);
  const float share = p > 0 ? exp2_of(log2_of(u) / (p + 1)) : u;  // (1 + cos a) / 2
  const float cos_a = 2 * share - 1;
  const float sin_a = 2 * std::sqrt(share * std::max(0.0f, 1 - share));
  const SinCos turn = sin_cos_of_turn(static_cast<float>(sobol[1]));
  const Basis basis = basis_around(emitter.axis);
  ray.direction = Vec3f(normalize(emitter.axis * static_cast<double>(cos_a) +
                                  basis.tangent * static_cast<double>(sin_a * turn.cos) +
                                  basis.bitangent * static_cast<double>(sin_a * turn.sin)));

  // The bands' densities in this direction, ((1 + cos a) / 2)^p (p + 1) / 4 pi, become weights of
  // sum 8.
  double sum = 0;
  std::array<double, kBandCount> density{};
  const float log2_share = log2_of(std::max(share, 1e-30f));
  for (std::size_t b = 0; b < kBandCount; ++b) {
    const float exponent = emitter.directivity[b];
    density[b] = static_cast<double>(exponent > 0 ? exp2_of(exponent * log2_share) : 1.0f) /
                 emission_power(static_cast<double>(exponent));
    sum += density[b];
  }
  for (std::size_t b = 0; b < kBandCount; ++b) {
    photon.power[b] = sum > 0 ? static_cast<float>(emitted_power(emitter, b)) : 0;
    photon.weight[b] = sum > 0 ? static_cast<float>(kBandCount * density[b] / sum) : 0;
  }
  return photon;
}

double PhotonTracer::deposit_threshold(std::uint32_t emitter) const {
  return settings_.deposit_threshold * emitted_power(level_.emitters[emitter]);
}

void PhotonTracer::first_rays(const PhotonRun& run, std::vector<Ray>& rays) const {
  rays.resize(run.count);
  for (std::uint32_t i = 0; i < run.count; ++i) emit(run.emitter, run.first + i, rays[i]);
}

void PhotonTracer::trace(std::span<const PhotonRun> runs, TracedRuns& result) const {
  while (!runs.empty()) {
    std::size_t together = 0, photons = 0;
    while (together < runs.size() && photons + runs[together].count <= kStepPhotons)
      photons += runs[together++].count;
    assert(together > 0 && "a run has at most kRunPhotons");
    trace_batch(runs.first(together), result);
    runs = runs.subspan(together);
  }
}

namespace {

// Adds a node for each photon that hits a surface.
void record_hits(std::span<KernelPhoton> photons, std::span<const std::uint16_t> alive,
                 std::span<const SurfaceHit> hits, std::vector<PathNode>& nodes) {
  for (std::size_t i = 0; i < alive.size(); ++i) {
    if (hits[i].material == SurfaceHit::kNone) continue;
    KernelPhoton& photon = photons[alive[i]];
    nodes.push_back({photon.node, hits[i].material});
    photon.node = static_cast<std::uint32_t>(nodes.size() - 1);
  }
}

// The materials that a run has met.
std::vector<ArrivedPower> met_of(std::span<const std::array<double, kBandCount>> by_material) {
  std::vector<ArrivedPower> met;
  for (std::size_t m = 0; m < by_material.size(); ++m) {
    if (by_material[m] == std::array<double, kBandCount>{}) continue;
    ArrivedPower& arrived = met.emplace_back();
    arrived.material = static_cast<std::uint32_t>(m);
    for (std::size_t b = 0; b < kBandCount; ++b)
      arrived.power[b] = static_cast<float>(by_material[m][b]);
  }
  return met;
}

}  // namespace

void PhotonTracer::trace_batch(std::span<const PhotonRun> runs, TracedRuns& result) const {
  const auto borrowed = workspaces_->borrow();
  TraceWorkspace& work = *borrowed;
  work.runs.clear();
  work.photons.clear();
  work.alive.clear();
  work.rays.clear();
  work.run_ends.clear();
  work.emitted.clear();
  work.arrived.assign(runs.size() * materials_.size(), {});
  for (const PhotonRun& run : runs) {
    assert(run.emitter < level_.emitters.size());
    const Emitter& emitter = level_.emitters[run.emitter];
    Bands& emitted = work.emitted.emplace_back();
    for (std::size_t b = 0; b < kBandCount; ++b)
      emitted[b] = static_cast<float>(emitted_power(emitter, b));
    KernelRun& kernel_run = work.runs.emplace_back();
    kernel_run.deposit_threshold = static_cast<float>(deposit_threshold(run.emitter));
    kernel_run.early_until_m = settings_.early_until_m;
    kernel_run.deposits_early = run.first < settings_.early_photons;
    kernel_run.emitter = run.emitter;
    kernel_run.tally.photons = run.count;
    kernel_run.arrived = work.arrived.data() + (work.runs.size() - 1) * materials_.size();
    for (std::uint32_t i = 0; i < run.count; ++i) {
      Ray ray;
      KernelPhoton& photon = work.photons.emplace_back(emit(run.emitter, run.first + i, ray));
      photon.run = static_cast<std::uint16_t>(work.runs.size() - 1);
      photon.index = static_cast<std::uint16_t>(i);
      if (!(*std::max_element(photon.power.begin(), photon.power.end()) > 0)) continue;
      work.alive.push_back(static_cast<std::uint16_t>(work.photons.size() - 1));
      work.rays.push_back(ray);
    }
    work.run_ends.push_back(static_cast<std::uint32_t>(work.photons.size()));
  }

  const std::size_t first_deposit = result.count_, first_tally = result.paths_.tallies.size();
  std::size_t alive = work.alive.size();
  work.hits.resize(work.photons.size());
  work.alive.resize(work.photons.size());
  work.rays.resize(work.photons.size());
  WeightWindow window(settings_.decay, kernel_settings_.roulette_exponent);
  for (std::uint32_t bounce = 1; alive > 0; ++bounce) {
    scene_.first_hits({work.rays.data(), alive}, {work.hits.data(), alive});
    if (!portals_.is_empty())
      portals_.add(work.photons, {work.alive.data(), alive}, {work.rays.data(), alive}, work.hits);
    result.make_room(result.count_ + 2 * alive);
    DepositSink sink{result.deposits_.data(), result.run_of_.data(), result.count_};
    if (result.records_paths_) {
      sink.nodes = result.paths_.deposits.data();
      sink.tallies = &result.paths_.tallies;
      record_hits(work.photons, {work.alive.data(), alive}, work.hits, result.paths_.nodes);
    }
    alive = shade(kernel_settings_, materials_, bounce, work.photons, {work.alive.data(), alive},
                  {work.rays.data(), alive}, work.hits, work.runs, *work.scratch, sink);
    result.count_ = sink.count;
    alive = window.apply(bounce, {work.photons, work.run_ends, work.emitted, work.alive, work.rays},
                         alive);
  }

  const std::size_t first_run = result.runs_.size();
  for (std::size_t t = first_tally; t < result.paths_.tallies.size(); ++t)
    result.paths_.tallies[t].run += static_cast<std::uint16_t>(first_run);
  for (std::size_t r = 0; r < runs.size(); ++r)
    result.runs_.push_back(
        {runs[r], 0, 0, work.runs[r].tally,
         met_of(std::span(work.arrived).subspan(r * materials_.size(), materials_.size()))});
  result.sort_by_run(first_deposit, first_run);
}

}  // namespace clamor
