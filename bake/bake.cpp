#include "bake/bake.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <list>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "bake/bake_journals.h"
#include "bake/bake_plan.h"
#include "bake/batch_tracing.h"
#include "bake/instances/emitter_instances.h"
#include "bake/journal/trace_journal.h"
#include "bake/path_cache.h"
#include "bake/portals/portal_sets.h"
#include "bake/probe_bake.h"
#include "bake/probe_tracing.h"
#include "bake/probes/probe_zones.h"
#include "bake/report/decay_estimate.h"
#include "bake/reweighed_photons.h"
#include "bake/source_finishing.h"
#include "bake/trace/kernel_material.h"
#include "bake/trace/photon_tracer.h"
#include "bake/trace/scene.h"
#include "bake/trace_pass.h"
#include "bake/traced_state.h"
#include "common/cpu_time.h"
#include "common/platform/thread.h"
#include "common/random.h"
#include "common/thread_team.h"
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

BakeContents describe(const TracedState& state, const BakeOptions& options,
                      const BatchTracing::Output& traced, const DecayEstimate& decay) {
  BakeContents contents;
  contents.settings = options.settings;
  contents.settings.photons = state.plan.wanted_photons;
  contents.settings.sources = state.plan.sources;
  contents.settings.longest_path_s = state.trace.longest_path_s;
  contents.settings.early_order = state.early_order;
  contents.provenance.tool = std::string("clamor ") + kVersion;
  contents.provenance.libraries = file_library_versions();
  contents.provenance.libraries.insert(contents.provenance.libraries.begin(),
                                       "Embree " + embree_version());
  const Level& level = state.level;
  contents.statistics =
      statistics_of(traced.tally, state.tracer, level, state.trace.longest_path_s);
  for (const auto& arrived : traced.power_arrived)
    contents.statistics.power_arrived.push_back(as_bands(arrived));
  contents.statistics.rooms = state.plan.rooms;
  contents.statistics.deposits = traced.deposits;
  contents.statistics.decay = decay.summary();
  contents.materials = deposit_materials(level.materials);
  contents.signals = level.signals;
  contents.mesh = level.mesh;
  contents.origin_m = level.origin_m;
  contents.movable_parts = level.movable_parts;
  contents.images = state.images();
  return contents;
}

// Numbers the sets of portals of the sources.
void number_portals(BatchTracing::Output& traced, PortalSetTable& table, std::size_t max_sets,
                    std::vector<PortalEmitter>& made) {
  if (!traced.portals.has_any()) return;
  traced.sources.for_blocks(
      [&](std::span<const Source> sources, std::size_t) { traced.portals.count(sources); });
  traced.portals.number(table, max_sets, made);
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

// The photons of a bake or of a shard, traced.
struct TracedLevel {
  std::vector<BatchTracing::Output> states;  // the level as it is, then with closed portals
  PortalSetTable portal_sets;
  std::vector<PortalEmitter> portal_emitters;
  BakedProbes probes;
};

// `states` has the level as it is, and receives that with closed portals.
Result<TracedLevel> trace_level(std::list<TracedState>& states, DecayEstimate& decay,
                                const BakePasses& passes) {
  const BakeOptions& options = passes.options;
  const TracedState& open = states.front();
  TracedLevel traced;
  const auto trace = [&](const TracedState& state, const char* stage, DecayEstimate* of_state) {
    auto output =
        trace_pass({stage, state.level, state.level, state.tracer, state.plan, of_state}, passes);
    if (output.ok()) traced.states.push_back(std::move(*output));
    return output.ok() ? Result<void>() : output.error();
  };
  if (const auto done = trace(open, "tracing", &decay); !done.ok()) return done.error();
  if (has_closed_state(open.level)) {
    const TracedState& closed = states.emplace_back(open, options.settings);
    if (const auto done = trace(closed, "closed portals", nullptr); !done.ok()) return done.error();
  }
  // Half of the sets are for probes, if there are any.
  const std::size_t max_sets = options.probes_m.empty() ? kMaxPortalSets : kMaxPortalSets / 2;
  for (BatchTracing::Output& state : traced.states)
    number_portals(state, traced.portal_sets, max_sets, traced.portal_emitters);
  auto probes = bake_probes(states, passes, traced.portal_sets);
  if (!probes.ok()) return probes.error();
  traced.probes = std::move(*probes);
  return traced;
}

// Adds the level's emitters, their images and their instances to the contents. Returns the sources
// of emitters that are in no instance.
std::vector<Source> add_emitters(const TracedState& open, EmitterInstances& instances,
                                 BakeContents& contents, BakeReport& report) {
  std::vector<Source> sources;
  for (const std::uint32_t i : instances.alone)
    sources.push_back(emitter_source(open.level.emitters[i], instances.table_index[i],
                                     open.tracer.emitter_key(i)));
  report.instanced_sources = instances.emitters;
  report.instanced_groups = instances.groups;
  report.instance_prototypes = instances.prototypes;
  for (ImageSource& image : contents.images) image.emitter = instances.table_index[image.emitter];
  contents.emitters = std::move(instances.table);
  contents.prototypes = std::move(instances.trees);
  contents.signal_maps = std::move(instances.signal_maps);
  return sources;
}

// Completes the sources of all states, and sorts them with `emitters` into the contents' octree.
Result<void> sort_all(std::vector<BatchTracing::Output>& states, std::vector<Source> emitters,
                      EmitterInstances& instances, const BakeOptions& options,
                      const SortPlace& place, BakeContents& contents) {
  std::optional<ScratchList<Source>> sources;
  for (BatchTracing::Output& state : states) {
    if (const auto done =
            finish_sources(state.sources, state.portals, contents.materials, place.step_bytes);
        !done.ok())
      return done;
    ScratchList<Source> more = std::exchange(state.sources, ScratchList<Source>());
    if (options.is_stopped()) return Error("stopped");
    if (!sources) {
      sources = std::move(more);
      continue;
    }
    auto joined = sources->reserve(sources->size() + more.size() + emitters.size());
    more.for_blocks([&](std::span<const Source> some, std::size_t) {
      if (joined.ok()) joined = sources->append(some);
    });
    if (!joined.ok()) return joined;
  }
  if (const auto added = sources->append(emitters); !added.ok()) return added;
  sort_sources(std::move(*sources), instances, place.step_bytes, contents);
  return {};
}

Result<BakeContents> bake_on_this_arena(const Level& level, const BakeOptions& options,
                                        BakeReport& report) {
  auto reweighed = reweigh(level, options, report);
  PathCache* const kept = reweighed || !options.probes_m.empty() || has_closed_state(level)
                              ? nullptr
                              : options.keeps_paths;
  std::list<TracedState> states;
  const TracedState& open =
      states.emplace_back(level, options.settings, reweighed ? &*reweighed : nullptr, kept);
  const auto place = check_memory(level, open.plan, options);
  report.exceeds_memory = !place.ok();
  if (!place.ok()) return place.error();
  auto journals =
      open_journals(deposit_materials(level.materials).size(), level.portals.size(), options);
  if (!journals.ok()) return journals.error();
  if (!options.journal.empty()) report.journal_runs = journals->list.front().runs();
  DecayEstimate decay = open.decay_estimate(reweighed.has_value());
  auto traced = trace_level(states, decay,
                            {options,
                             *journals,
                             report,
                             {},
                             reweighed ? &*reweighed : nullptr,
                             kept,
                             place->storage == SortStorage::kFiles});
  if (!traced.ok()) return traced.error();
  if (options.on_progress) {
    BakeProgress progress = traced->states.front().progress;
    progress.stage = "sorting";
    options.on_progress(progress);
  }

  const BatchTracing::Output& as_it_is = traced->states.front();
  BakeContents contents = describe(open, options, as_it_is, decay);
  contents.probes = std::move(traced->probes);
  if (!level.portals.empty())
    contents.portals = {level.portals, traced->portal_sets.sets(), traced->portal_emitters};
  EmitterInstances instances =
      instance_emitters(level, options.groups, as_it_is.tally.photons > 0, options.settings.seed);
  std::vector<Source> emitters = add_emitters(open, instances, contents, report);
  states.clear();  // what traced, before sorting takes its place in memory
  if (const auto sorted =
          sort_all(traced->states, std::move(emitters), instances, options, *place, contents);
      !sorted.ok())
    return sorted.error();
  if (!options.journal.empty()) compact(journals->list.front(), options, report);
  return contents;
}

Result<BakeReport> shard_on_this_arena(const Level& level, const BakeOptions& options,
                                       const Shard& shard) {
  std::list<TracedState> states;
  const TracedState& open = states.emplace_back(level, options.settings);
  if (const auto fits = check_shard_memory(level, open.plan, options); !fits.ok())
    return fits.error();
  auto journals =
      open_journals(deposit_materials(level.materials).size(), level.portals.size(), options);
  if (!journals.ok()) return journals.error();
  TraceJournal& journal = journals->list.front();
  DecayEstimate decay = open.decay_estimate(false);
  BakeReport report;
  const auto traced = trace_level(states, decay, {options, *journals, report, shard});
  if (!traced.ok() && !options.is_stopped()) return traced.error();
  if (traced.ok() && options.note)
    if (const auto noted = journal.set_note(options.note->completed().text()); !noted.ok())
      return noted.error();
  if (const auto synced = journal.sync(); !synced.ok()) return synced.error();
  report.journal_bytes = journal.bytes();
  if (traced.ok() && journal.damaged() > 0)
    if (const auto whole = journal.compact(true); !whole.ok()) return whole.error();
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
  with_team(std::min(options.threads, usable_cores()), [&] { outcome = work(); });
  if (options.is_stopped()) outcome = Error("stopped before the bake was complete");
  return outcome;
}

}  // namespace

Result<BakeContents> bake(const Level& level, const BakeOptions& options, BakeReport* report) {
  BakeReport ignored;
  BakeReport& told = report != nullptr ? *report : ignored;
  told = {};
  return on_arena(level, options, [&] { return bake_on_this_arena(level, options, told); });
}

Result<BakeCost> bake_cost(const Level& level, const BakeOptions& options) {
  BakeOptions on_one_thread = options;
  on_one_thread.threads = 1;
  return on_arena(level, on_one_thread, [&]() -> Result<BakeCost> {
    const double start_s = thread_time_s();
    const TracedState open(level, options.settings);
    BakeCost cost;
    cost.preparing_s = thread_time_s() - start_s;
    cost.triangles = level.mesh.triangles.size();
    cost.settings = options.settings;
    cost.settings.photons = open.plan.wanted_photons;
    cost.settings.sources = open.plan.sources;
    cost.settings.longest_path_s = open.trace.longest_path_s;
    TracedPart part = trace_part(open.tracer, open.plan);
    cost.photons = open.plan.all_photons();
    if (!options.probes_m.empty()) {
      const ProbeZones zones = group_probes(open.scene, level.portals, options.probes_m);
      const Level probes = level_of_probes(level, options.probes_m, zones);
      const ProbePlan plan = plan_probes(open.scene, probes, zones, options.probe_sources,
                                         open.probe_photons(options.settings), open.trace);
      cost.photons += plan.photons.all_photons();
      const TracedPart of_probes =
          trace_part(PhotonTracer(open.scene, probes, plan.trace), plan.photons);
      part.photons += of_probes.photons;
      part.seconds += of_probes.seconds;
      part.bytes += of_probes.bytes;
    }
    if (has_closed_state(level)) cost.photons *= 2;
    if (part.seconds > 0) cost.photons_per_core_s = part.photons / part.seconds;
    if (part.photons > 0) cost.bytes_per_photon = part.bytes / part.photons;
    cost.shard_memory_bytes = shard_memory_bytes(level, open.plan, 1);
    cost.thread_memory_bytes = shard_memory_bytes(level, open.plan, 2) - cost.shard_memory_bytes;
    cost.merge_memory_bytes = bake_memory_bytes(level, open.plan, 1);
    return cost;
  });
}

Result<BakeReport> bake_shard(const Level& level, const BakeOptions& options, const Shard& shard) {
  assert(shard.index < shard.count && !options.journal.empty());
  return on_arena(level, options, [&] { return shard_on_this_arena(level, options, shard); });
}

}  // namespace clamor
