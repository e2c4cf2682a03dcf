#include "bake/bake.h"

#include <algorithm>
#include <cmath>
#include <mutex>
#include <numeric>
#include <thread>

#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>

#include "bake/octree_builder.h"
#include "bake/patch_radius.h"
#include "bake/photon_tracer.h"
#include "bake/scene.h"
#include "common/random.h"
#include "common/version.h"
#include "formats/page.h"

namespace clamor {

namespace {

constexpr std::uint64_t kBatchPhotons = 256;
constexpr std::uint64_t kPilotPhotons = 1024;
constexpr std::uint64_t kWantedSources = 200'000;  // where --photons does not say

struct Traced {
  std::vector<Source> deposits;
  TraceTally tally;
};

bool stopped(const BakeOptions& options) {
  return options.stop != nullptr && options.stop->load(std::memory_order_relaxed);
}

// How many photons each emitter gets: in proportion to its power, and at least one.
std::vector<std::uint64_t> allotted(const Level& level, std::uint64_t photons) {
  std::vector<double> power(level.emitters.size(), 0);
  for (std::size_t i = 0; i < power.size(); ++i)
    for (std::size_t b = 0; b < kBandCount; ++b) power[i] += emitted_power(level.emitters[i], b);
  const double total = std::accumulate(power.begin(), power.end(), 0.0);
  std::vector<std::uint64_t> counts;
  for (const double emitted : power) {
    const double share = total > 0 ? emitted / total : 0;
    counts.push_back(std::max<std::uint64_t>(
        1, static_cast<std::uint64_t>(std::llround(share * static_cast<double>(photons)))));
  }
  return counts;
}

// Cuts the photons into runs, and the runs into batches of about kRunPhotons that a thread traces.
std::vector<std::vector<PhotonRun>> batches_of(std::span<const std::uint64_t> counts) {
  std::vector<std::vector<PhotonRun>> batches(1);
  std::uint64_t filled = 0;
  for (std::uint32_t emitter = 0; emitter < counts.size(); ++emitter)
    for (std::uint64_t first = 0; first < counts[emitter]; first += kBatchPhotons) {
      const auto count =
          static_cast<std::uint32_t>(std::min(kBatchPhotons, counts[emitter] - first));
      if (filled + count > kBatchPhotons && !batches.back().empty()) {
        batches.emplace_back();
        filled = 0;
      }
      batches.back().push_back({emitter, first, count});
      filled += count;
    }
  return batches;
}

// Traces the photons in batches of a fixed size and joins the batches in order, so that neither
// deposits nor sums depend on the number of threads.
Traced trace_all(const PhotonTracer& tracer, std::span<const std::uint64_t> counts,
                 const BakeOptions& options) {
  const auto batches = batches_of(counts);
  std::vector<TracedRuns> parts(batches.size());
  std::mutex reporting;
  BakeProgress progress{"tracing", 0,
                        std::accumulate(counts.begin(), counts.end(), std::uint64_t{0}), 0};
  tbb::parallel_for(std::size_t{0}, batches.size(), [&](std::size_t batch) {
    if (stopped(options)) return;
    TracedRuns& part = parts[batch];
    tracer.trace(batches[batch], part);
    const std::lock_guard lock(reporting);
    for (const TracedRun& run : part.runs()) {
      progress.photons_done += run.tally.photons;
      progress.bounces += run.tally.bounces;
    }
    if (options.on_progress) options.on_progress(progress);
  });

  Traced all;
  std::size_t total = 0;
  for (const TracedRuns& part : parts) total += part.deposits().size();
  all.deposits.reserve(total);
  for (TracedRuns& part : parts) {
    for (const TracedRun& run : part.runs()) {
      const double share = 1 / static_cast<double>(counts[run.run.emitter]);
      for (std::size_t i = 0; i < run.deposits; ++i) {
        all.deposits.push_back(part.deposits()[run.first_deposit + i]);
        for (float& power : all.deposits.back().power) power = static_cast<float>(power * share);
      }
      all.tally.add(run.tally, share);
    }
    part = {};
  }
  return all;
}

// As many photons as leave about kWantedSources behind, judged by a few of them.
std::uint64_t photons_for(const PhotonTracer& tracer, const Level& level) {
  TracedRuns pilot;
  std::uint64_t photons = 0;
  for (const auto& batch : batches_of(allotted(level, kPilotPhotons))) tracer.trace(batch, pilot);
  for (const TracedRun& run : pilot.runs()) photons += run.tally.photons;
  const double per_photon =
      std::max(1.0, static_cast<double>(pilot.deposits().size()) / static_cast<double>(photons));
  const double wanted = std::round(static_cast<double>(kWantedSources) / per_photon / 100) * 100;
  return static_cast<std::uint64_t>(std::clamp(wanted, 1000.0, 200000.0));
}

Source emitter_source(const Emitter& emitter, std::uint32_t index, std::uint64_t seed) {
  Source source;
  source.emitter = index;
  set_from_emitter(source, emitter);
  // Bounce 0 is no reflection, so the counter is free.
  const RandomBits bits = philox(seed, {index, 0, 0, static_cast<std::uint32_t>(Use::kPolarity)});
  source.u = static_cast<float>(unit_above_zero(bits[0]));
  return source;
}

Bands as_bands(const std::array<double, kBandCount>& values) {
  Bands bands{};
  std::transform(values.begin(), values.end(), bands.begin(),
                 [](double value) { return static_cast<float>(value); });
  return bands;
}

BakeStatistics statistics_of(const TraceTally& tally, const PhotonTracer& tracer,
                             const Level& level) {
  BakeStatistics statistics;
  statistics.photons_traced = tally.photons;
  statistics.bounces = tally.bounces;
  statistics.photons_escaped = tally.escaped;
  statistics.mean_free_path_m = tally.legs > 0 ? tally.legs_m / static_cast<double>(tally.legs) : 0;
  statistics.power_emitted = as_bands(tracer.power_emitted());
  statistics.power_escaped = as_bands(tally.power_escaped);
  statistics.power_unfinished = as_bands(tally.power_unfinished);

  if (level.mesh.triangles.empty())
    statistics.warnings.push_back("The level has no triangles: this is a free field.");
  const bool lets_through =
      std::any_of(level.materials.begin(), level.materials.end(), [](const Material& material) {
        return *std::max_element(material.transmission.begin(), material.transmission.end()) > 0;
      });
  if (lets_through)
    statistics.warnings.push_back(
        "Some materials let sound through, which this version does not trace: their walls reflect "
        "and absorb only.");
  return statistics;
}

BakeContents bake_on_this_arena(const Level& level, const BakeOptions& options) {
  const Scene scene(level.mesh);
  TraceSettings settings;
  settings.seed = options.settings.seed;
  settings.roulette_kappa = options.settings.roulette_kappa;
  settings.longest_path_s = options.settings.longest_path_s;
  settings.speed_mps = speed_of_sound_mps(options.settings.air);
  settings.air_loss_per_m = air_loss_per_m(options.settings.air);
  const PhotonTracer tracer(scene, level, settings);
  const std::uint64_t photons =
      options.settings.photons > 0 ? options.settings.photons : photons_for(tracer, level);
  Traced traced = trace_all(tracer, allotted(level, photons), options);

  BakeContents contents;
  contents.settings = options.settings;
  contents.settings.photons = photons;
  contents.provenance.tool = std::string("clamor ") + kVersion;
  contents.statistics = statistics_of(traced.tally, tracer, level);
  contents.materials = level.materials;
  contents.emitters = level.emitters;
  contents.signals = level.signals;
  contents.mesh = level.mesh;
  if (stopped(options)) return contents;

  if (options.on_progress) options.on_progress({"sorting", photons, photons, traced.tally.bounces});
  set_patch_radii(traced.deposits);
  for (Source& deposit : traced.deposits) snap_powers(deposit);
  for (std::size_t i = 0; i < level.emitters.size(); ++i)
    traced.deposits.push_back(
        emitter_source(level.emitters[i], static_cast<std::uint32_t>(i), options.settings.seed));
  contents.octree = build_octree(std::move(traced.deposits));
  return contents;
}

}  // namespace

Result<BakeContents> bake(const Level& level, const BakeOptions& options) {
  if (level.emitters.empty())
    return Error(
        "the level has no emitter, so there is nothing to bake; add one with --emitter "
        "\"name=violin,signal=violin.flac,at=0,1.5,0\", in LEVEL.acoustics.json or as "
        "KHR_audio_emitter");
  BakeContents contents;
  tbb::task_arena arena(options.threads > 0 ? options.threads : tbb::task_arena::automatic);
  arena.execute([&] { contents = bake_on_this_arena(level, options); });
  if (stopped(options)) return Error("stopped before the bake was complete; nothing was written");
  return contents;
}

}  // namespace clamor
