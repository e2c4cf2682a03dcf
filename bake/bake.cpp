#include "bake/bake.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <optional>

#include <tbb/info.h>
#include <tbb/task_arena.h>

#include "bake/bake_journals.h"
#include "bake/bake_memory.h"
#include "bake/bake_plan.h"
#include "bake/batch_tracing.h"
#include "bake/closed_state.h"
#include "bake/early/image_search.h"
#include "bake/instances/emitter_instances.h"
#include "bake/journal/run_key.h"
#include "bake/path_cache.h"
#include "bake/portals/portal_sets.h"
#include "bake/probe_bake.h"
#include "bake/probe_tracing.h"
#include "bake/probes/probe_zones.h"
#include "bake/report/decay_estimate.h"
#include "bake/source_finishing.h"
#include "bake/trace/kernel_material.h"
#include "bake/trace/photon_tracer.h"
#include "bake/trace/scene.h"
#include "common/cpu_time.h"
#include "common/random.h"
#include "common/version.h"
#include "formats/bake_file/bake_layout.h"
#include "formats/bake_file/bake_writer.h"
#include "formats/bake_file/page.h"
#include "formats/level/level.h"

namespace clamor {

namespace {

Source emitter_source(const Emitter& emitter, std::uint32_t index, std::uint64_t key) {
  Source source;
  source.emitter = index;
  set_from_emitter(source, emitter);
  // Bounce 0 is no reflection, so its counter is free for u.
  const RandomBits bits = philox(key, {0, 0, 0, static_cast<std::uint32_t>(Use::kPolarity)});
  source.u = static_cast<float>(unit_above_zero(bits[0]));
  return source;
}

Bands as_bands(const std::array<double, kBandCount>& values) {
  Bands bands{};
  std::transform(values.begin(), values.end(), bands.begin(),
                 [](double value) { return static_cast<float>(value); });
  return bands;
}

// Formats "0.25 %" without floating-point printing, which varies between platforms.
std::string in_percent(double share) {
  const std::string hundredths = std::to_string(std::llround(1e4 * share));
  const std::string digits =
      std::string(hundredths.size() < 3 ? 3 - hundredths.size() : 0, '0') + hundredths;
  return digits.substr(0, digits.size() - 2) + "." + digits.substr(digits.size() - 2) + " %";
}

BakeStatistics statistics_of(const TraceTally& tally, const PhotonTracer& tracer,
                             const Level& level, double longest_path_s) {
  BakeStatistics statistics;
  statistics.photons_traced = tally.photons;
  statistics.bounces = tally.bounces;
  statistics.photons_escaped = tally.escaped;
  statistics.mean_free_path_m = tally.legs > 0 ? tally.legs_m / static_cast<double>(tally.legs) : 0;
  statistics.power_emitted = as_bands(tracer.power_emitted());
  statistics.power_escaped = as_bands(tally.power_escaped);
  statistics.power_unfinished = as_bands(tally.power_unfinished);

  const double emitted = sum_of(statistics.power_emitted);
  const double unfinished = sum_of(statistics.power_unfinished);
  if (emitted > 0 && unfinished > 0.001 * emitted)
    statistics.warnings.push_back(
        in_percent(unfinished / emitted) +
        " of the power was still under way at the longest path, so the reverberation ends early" +
        (longest_path_s < kLongestPath_s ? "; --longest 60 traces more" : ""));
  if (level.mesh.triangles.empty())
    statistics.warnings.push_back("The level has no triangles: sound meets nothing, a free field.");
  return statistics;
}

// Everything needed to trace a level.
struct TraceSetup {
  // `reweighed`: photons that are not traced again, or null. `kept`: where those of the last bake
  // are, or null.
  TraceSetup(const Level& level, const BakeSettings& settings,
             const ReweighedPhotons* reweighed = nullptr, const PathCache* kept = nullptr)
      : scene(level.mesh, reweighed != nullptr ? Scene::Build::kQuick : Scene::Build::kThorough),
        early_order(settings.early_order < 0 ? image_order_for(level.emitters.size())
                                             : std::min(settings.early_order, kMaxImageOrder)),
        trace(trace_settings(settings)),
        plan(reweighed != nullptr ? reweighed->plan()
                                  : make_bake_plan(scene, level, settings, trace)),
        tracer(scene, level, complete(level, reweighed, kept)) {
    if (reweighed != nullptr && settings.sources > 0) plan.sources = settings.sources;
  }

  const TraceSettings& complete(const Level& level, const ReweighedPhotons* reweighed,
                                const PathCache* kept) {
    if (kept != nullptr) keep_estimates(plan, kept->plan());
    trace.deposit_threshold = plan.deposit_threshold;
    trace.decay = plan.decay;
    trace.longest_path_s = plan.longest_path_s;
    trace.fade_s = plan.fade_s;
    if (reweighed != nullptr)
      trace.images = reweighed->images();
    else if (auto images = find_images(scene, level, early_order); !images.empty())
      trace.images = std::make_shared<const ImageIndex>(images);
    if (has_closed_state(level)) trace.first_portals = PortalSet::of_state(PortalSet::kStateOpen);
    return trace;
  }

  // Uses about 400 000 deposits at most, which costs a few percent of the tracing time, and fewer
  // where nothing is traced.
  DecayEstimate decay_estimate(const Level& level, bool is_reweighed) const {
    const double deposits = is_reweighed ? 30'000 : 400'000;
    return {scene, level, trace, plan.photons,
            static_cast<std::uint64_t>(plan.deposits / deposits)};
  }

  std::vector<ImageSource> images() const {
    if (trace.images == nullptr) return {};
    return {trace.images->images().begin(), trace.images->images().end()};
  }

  Scene scene;
  int early_order;
  TraceSettings trace;
  BakePlan plan;
  PhotonTracer tracer;
};

// The photons that the probes' numbers are bounded by. A level without emitters traces none itself.
std::uint64_t probe_photons(const BakePlan& plan, const BakeOptions& options) {
  return plan.photons.empty() && options.settings.photons == 0 ? ~std::uint64_t{0}
                                                               : plan.wanted_photons;
}

void describe(const Level& level, const BakeOptions& options, const TraceSetup& setup,
              const BatchTracing::Output& traced, const DecayEstimate& decay,
              BakeContents& contents) {
  contents.settings = options.settings;
  contents.settings.photons = setup.plan.wanted_photons;
  contents.settings.sources = setup.plan.sources;
  contents.settings.longest_path_s = setup.trace.longest_path_s;
  contents.provenance.tool = std::string("clamor ") + kVersion;
  contents.provenance.libraries = file_library_versions();
  contents.provenance.libraries.insert(contents.provenance.libraries.begin(),
                                       "Embree " + embree_version());
  contents.statistics =
      statistics_of(traced.tally, setup.tracer, level, setup.trace.longest_path_s);
  for (const auto& arrived : traced.power_arrived)
    contents.statistics.power_arrived.push_back(as_bands(arrived));
  contents.statistics.rooms = setup.plan.rooms;
  contents.statistics.deposits = traced.deposits;
  contents.statistics.decay = decay.summary();
  contents.settings.early_order = setup.early_order;
  contents.materials = deposit_materials(level.materials);
  contents.signals = level.signals;
  contents.mesh = level.mesh;
  contents.origin_m = level.origin_m;
  contents.movable_parts = level.movable_parts;
}

// Numbers the sets of portals of the sources.
Result<void> number_portals(BatchTracing::Output& traced, PortalSetTable& table,
                            std::size_t max_sets, std::vector<PortalEmitter>& made) {
  if (!traced.on_disk) {
    traced.portals.finish(traced.sources, table, max_sets, made);
    return {};
  }
  if (!traced.portals.has_any()) return {};
  const auto counted = traced.on_disk->for_each([&](std::span<Source> sources) -> Result<void> {
    traced.portals.count(sources);
    return {};
  });
  if (counted.ok()) traced.portals.number(table, max_sets, made);
  return counted;
}

void compact(TraceJournal& journal, const BakeOptions& options, BakeReport& report) {
  if (const auto compacted = journal.compact(); !compacted.ok())
    report.journal_warning = compacted.error().message;
  report.journal_bytes = journal.bytes();
  if (journal.damaged() > 0)
    report.journal_warning = options.journal + ": " + std::to_string(journal.damaged()) +
                             " of its records were damaged and have been traced again";
}

// The photons of earlier bakes with the absorption of this level, if they are wanted and fit.
std::optional<ReweighedPhotons> reweigh(const Level& level, const BakeOptions& options,
                                        BakeReport& report) {
  if (options.reweighs == nullptr) return std::nullopt;
  auto photons = options.probes_m.empty() ? options.reweighs->reweigh(level, options.settings)
                                          : Error("probes are traced anew");
  report.is_reweighed = photons.ok();
  if (photons.ok()) return std::move(*photons);
  report.why_traced = photons.error().message;
  return std::nullopt;
}

Result<BakeContents> bake_on_this_arena(const Level& level, const BakeOptions& options,
                                        BakeReport& report) {
  auto reweighed = reweigh(level, options, report);
  PathCache* const kept = reweighed || !options.probes_m.empty() || has_closed_state(level)
                              ? nullptr
                              : options.keeps_paths;
  const TraceSetup setup(level, options.settings, reweighed ? &*reweighed : nullptr, kept);
  if (options.is_stopped()) return BakeContents{};
  BakePlan all_states = setup.plan;
  if (has_closed_state(level)) all_states.sources *= 2;
  const auto sorted = check_memory(level, all_states, options);
  report.exceeds_memory = !sorted.ok();
  if (!sorted.ok()) return sorted.error();
  auto journals = open_journals(level, options);
  if (!journals.ok()) return journals.error();
  if (!options.journal.empty()) report.journal_runs = journals->list.front().runs();
  const RunKeys keys(level, setup.tracer, scene_hash(level, setup.trace));
  JournalSet journal_set(*journals, keys);
  std::optional<KeptPaths> kept_paths;
  RunSource* source = &journal_set;
  if (reweighed) source = &*reweighed;
  if (kept != nullptr) {
    kept->begin(level, options.settings, setup.plan, setup.trace, keys.scene());
    source = &kept_paths.emplace(*kept, journal_set, keys);
  }
  DecayEstimate decay = setup.decay_estimate(level, reweighed.has_value());
  const bool on_disk = sorted->storage == SortStorage::kFiles;
  BatchTracing tracing(setup.tracer, setup.plan, options, *source, {}, &decay);
  if (on_disk) tracing.thin_on_disk(options.spill);
  auto traced = tracing.run();
  if (!traced.ok()) return traced.error();
  report.photons = tracing.progress().photons_done;
  report.photons_reused = tracing.progress().photons_reused;
  if (options.is_stopped()) return BakeContents{};
  auto closed = trace_closed_state(level, setup.trace, options, *journals, {}, report, on_disk);
  if (!closed.ok()) return closed.error();
  if (options.is_stopped()) return BakeContents{};
  BakedPortals portals;
  PortalSetTable portal_sets;
  // Half of the sets are for probes, if there are any.
  const std::size_t max_sets = options.probes_m.empty() ? kMaxPortalSets : kMaxPortalSets / 2;
  for (BatchTracing::Output* state : {&*traced, &*closed})
    if (const auto done = number_portals(*state, portal_sets, max_sets, portals.emitters);
        !done.ok())
      return done.error();
  auto probes = bake_probes(setup.scene, level, options, setup.trace,
                            probe_photons(setup.plan, options), *journals, portal_sets);
  if (!probes.ok()) return probes.error();
  report.probe_photons = probes->photons;
  report.photons_reused += probes->photons_reused;
  if (options.is_stopped()) return BakeContents{};
  if (options.on_progress) {
    BakeProgress progress = tracing.progress();
    progress.stage = "sorting";
    options.on_progress(progress);
  }

  BakeContents contents;
  describe(level, options, setup, *traced, decay, contents);
  finish_sources(traced->sources, contents.materials);
  finish_sources(closed->sources, contents.materials);
  SourceSpill list(options.spill);
  for (BatchTracing::Output* state : {&*traced, &*closed})
    if (const auto done =
            finish_on_disk(*state, options, sorted->step_bytes, contents.materials, list);
        !done.ok() && !options.is_stopped())
      return done.error();
  traced->sources.insert(traced->sources.end(), closed->sources.begin(), closed->sources.end());
  closed->sources = {};
  if (options.is_stopped()) return contents;
  EmitterInstances instances =
      instance_emitters(level, options.groups, traced->tally.photons > 0, options.settings.seed);
  for (const std::uint32_t i : instances.alone)
    traced->sources.push_back(
        emitter_source(level.emitters[i], instances.table_index[i], setup.tracer.emitter_key(i)));
  report.instanced_sources = instances.emitters;
  report.instanced_groups = instances.groups;
  report.instance_prototypes = instances.prototypes;
  contents.images = setup.images();
  for (ImageSource& image : contents.images) image.emitter = instances.table_index[image.emitter];
  contents.emitters = std::move(instances.table);
  contents.prototypes = std::move(instances.trees);
  contents.signal_maps = std::move(instances.signal_maps);
  contents.probes = std::move(probes->probes);
  if (!level.portals.empty()) {
    portals.portals = level.portals;
    portals.sets = portal_sets.sets();
    contents.portals = std::move(portals);
  }
  if (options.is_stopped()) return contents;
  if (on_disk) {
    // Only the emitters are in memory.
    if (const auto added = list.append(traced->sources); !added.ok()) return added.error();
    sort_on_disk(std::move(list), instances, sorted->step_bytes, contents);
  } else {
    sort_sources(std::move(traced->sources), instances, contents);
  }
  if (!options.journal.empty()) compact(journals->list.front(), options, report);
  return contents;
}

Result<BakeReport> shard_on_this_arena(const Level& level, const BakeOptions& options,
                                       const Shard& shard) {
  const TraceSetup setup(level, options.settings);
  if (const auto fits = check_shard_memory(level, setup.plan, options); !fits.ok())
    return fits.error();
  auto journals = open_journals(level, options);
  if (!journals.ok()) return journals.error();
  JournalSet journal_set(*journals, RunKeys(level, setup.tracer, scene_hash(level, setup.trace)));
  DecayEstimate decay = setup.decay_estimate(level, false);
  BatchTracing tracing(setup.tracer, setup.plan, options, journal_set, shard, &decay);
  if (const auto traced = tracing.run(); !traced.ok()) return traced.error();
  BakeReport report;
  const auto closed = trace_closed_state(level, setup.trace, options, *journals, shard, report);
  if (!closed.ok()) return closed.error();
  PortalSetTable portals;
  const auto probes = bake_probes(setup.scene, level, options, setup.trace,
                                  probe_photons(setup.plan, options), *journals, portals, shard);
  if (!probes.ok()) return probes.error();
  if (!options.complete_note.empty() && !options.is_stopped())
    if (const auto noted = journals->list.front().set_note(options.complete_note); !noted.ok())
      return noted.error();
  if (const auto synced = journals->list.front().sync(); !synced.ok()) return synced.error();
  report.photons += tracing.progress().photons_done;
  report.probe_photons = probes->photons;
  report.photons_reused += tracing.progress().photons_reused + probes->photons_reused;
  report.journal_bytes = journals->list.front().bytes();
  if (journals->list.front().damaged() > 0 && !options.is_stopped())
    if (const auto whole = journals->list.front().compact(true); !whole.ok()) return whole.error();
  return report;
}

// Photons of a plan, traced on one thread to see what they cost. Its processor time counts, so that
// a busy machine does not look slow.
struct TracedPart {
  double photons = 0, seconds = 0, bytes = 0;
};

TracedPart trace_part(const PhotonTracer& tracer, const BakePlan& plan) {
  constexpr double kEnough_s = 1;
  constexpr std::size_t kMostBatches = 200;
  const auto batches = plan.batches();
  const std::size_t count = std::min(batches.size(), kMostBatches);
  TracedPart part;
  TracedRuns traced;
  for (std::size_t i = 0; i < count && part.seconds < kEnough_s; ++i) {
    // Spread over the emitters: the golden section visits all parts of the list early.
    const double place = static_cast<double>(i) * 0.6180339887498949;
    const auto& batch = batches[static_cast<std::size_t>((place - std::floor(place)) *
                                                         static_cast<double>(batches.size()))];
    traced.clear();
    const double start_s = thread_time_s();
    tracer.trace(batch, traced);
    part.bytes += static_cast<double>(
        packed(std::as_bytes(std::span(traced.deposits().data(), traced.deposits().size())))
            .size());
    part.seconds += thread_time_s() - start_s;
    for (const PhotonRun& run : batch) part.photons += run.count;
  }
  return part;
}

// Runs `work` with options.threads threads.
template <class Work>
auto on_arena(const Level& level, const BakeOptions& options, const Work& work) {
  using Outcome = decltype(work());
  Outcome outcome = Error(
      "the level has no emitter, so there is nothing to bake; add one with --emitter "
      "\"name=violin,signal=violin.flac,at=0,1.5,0\", in LEVEL.acoustics.json or as "
      "KHR_audio_emitter");
  if (level.emitters.empty() && options.probes_m.empty()) return outcome;
  // TBB warns if asked for more threads than the machine has cores.
  const int cores = tbb::info::default_concurrency();
  tbb::task_arena arena(options.threads > 0 ? std::min(options.threads, cores) : cores);
  arena.execute([&] { outcome = work(); });
  if (outcome.ok() && options.is_stopped()) outcome = Error("stopped before the bake was complete");
  return outcome;
}

}  // namespace

Result<BakeContents> bake(const Level& level, const BakeOptions& options, BakeReport* report) {
  BakeReport ignored;
  return on_arena(level, options, [&] {
    return bake_on_this_arena(level, options, report != nullptr ? *report : ignored);
  });
}

Result<BakeCost> bake_cost(const Level& level, const BakeOptions& options) {
  BakeOptions on_one_thread = options;
  on_one_thread.threads = 1;
  return on_arena(level, on_one_thread, [&]() -> Result<BakeCost> {
    const double start_s = thread_time_s();
    const TraceSetup setup(level, options.settings);
    BakeCost cost;
    cost.preparing_s = thread_time_s() - start_s;
    cost.triangles = level.mesh.triangles.size();
    cost.settings = options.settings;
    cost.settings.photons = setup.plan.wanted_photons;
    cost.settings.sources = setup.plan.sources;
    cost.settings.longest_path_s = setup.trace.longest_path_s;
    TracedPart part = trace_part(setup.tracer, setup.plan);
    cost.photons = setup.plan.all_photons();
    if (!options.probes_m.empty()) {
      const ProbeZones zones = group_probes(setup.scene, level.portals, options.probes_m);
      const Level probes = level_of_probes(level, options.probes_m, zones);
      const ProbePlan plan = plan_probes(setup.scene, probes, zones, options.probe_sources,
                                         probe_photons(setup.plan, options), setup.trace);
      cost.photons += plan.photons.all_photons();
      const TracedPart of_probes =
          trace_part(PhotonTracer(setup.scene, probes, plan.trace), plan.photons);
      part.photons += of_probes.photons;
      part.seconds += of_probes.seconds;
      part.bytes += of_probes.bytes;
    }
    if (has_closed_state(level)) cost.photons *= 2;
    if (part.seconds > 0) cost.photons_per_core_s = part.photons / part.seconds;
    if (part.photons > 0) cost.bytes_per_photon = part.bytes / part.photons;
    cost.shard_memory_bytes = shard_memory_bytes(level, setup.plan, 1);
    cost.thread_memory_bytes = shard_memory_bytes(level, setup.plan, 2) - cost.shard_memory_bytes;
    cost.merge_memory_bytes = bake_memory_bytes(level, setup.plan, 1) +
                              DecayEstimate::max_bytes(setup.plan.longest_path_s);
    return cost;
  });
}

Result<BakeReport> bake_shard(const Level& level, const BakeOptions& options, const Shard& shard) {
  assert(shard.index < shard.count && !options.journal.empty());
  return on_arena(level, options, [&] { return shard_on_this_arena(level, options, shard); });
}

}  // namespace clamor
