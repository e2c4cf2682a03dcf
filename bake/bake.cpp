#include "bake/bake.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <memory>
#include <mutex>
#include <optional>

#include <tbb/parallel_pipeline.h>
#include <tbb/task_arena.h>

#include "bake/bake_plan.h"
#include "bake/octree_builder.h"
#include "bake/patch_radius.h"
#include "bake/photon_tracer.h"
#include "bake/scene.h"
#include "bake/source_thinning.h"
#include "bake/trace_journal.h"
#include "common/random.h"
#include "common/version.h"
#include "formats/page.h"

namespace clamor {

namespace {

// What all batches left behind, put together.
struct Assembled {
  std::vector<Source> deposits;
  TraceTally tally;
  std::uint64_t left = 0;  // deposits before thinning
};

// One batch on its way: looked up, traced if need be, kept, added.
struct Batch {
  std::size_t number = 0;
  std::vector<PhotonRun> missing;
  std::vector<std::uint64_t> missing_keys;
  TracedRuns found, traced;
};

bool stopped(const BakeOptions& options) {
  return options.stop != nullptr && options.stop->load(std::memory_order_relaxed);
}

// Traces what the journal does not have. Batches pass through a pipeline: looked up in order,
// traced in any order, added in order.
class Tracing {
 public:
  Tracing(const PhotonTracer& tracer, const Level& level, const BakePlan& plan,
          const BakeOptions& options, std::span<TraceJournal> journals, std::uint64_t scene,
          const Shard& shard)
      : tracer_(tracer),
        level_(level),
        plan_(plan),
        options_(options),
        journals_(journals),
        journal_(options.journal.empty() ? nullptr : &journals.front()),
        scene_(scene),
        shard_(shard),
        thinning_(plan.sources) {
    progress_.stage = "tracing";
    batches_ = plan.batches();
    if (shard.count > 1) {
      std::vector<std::vector<PhotonRun>> mine;
      for (std::size_t i = shard.index; i < batches_.size(); i += shard.count)
        mine.push_back(std::move(batches_[i]));
      batches_ = std::move(mine);
    }
    for (const auto& batch : batches_)
      for (const PhotonRun& run : batch) progress_.photons_total += run.count;
  }

  // An Error only if the journal cannot be written.
  Result<Assembled> run() {
    const std::size_t at_once =
        4 * static_cast<std::size_t>(tbb::this_task_arena::max_concurrency());
    std::vector<std::unique_ptr<Batch>> free;
    for (std::size_t i = 0; i < at_once; ++i) free.push_back(std::make_unique<Batch>());
    std::size_t next = 0;
    std::mutex free_mutex;
    tbb::parallel_pipeline(
        at_once,
        tbb::make_filter<void, Batch*>(tbb::filter_mode::serial_in_order,
                                       [&](tbb::flow_control& control) -> Batch* {
                                         if (next == batches_.size() || stopped(options_) ||
                                             failed_) {
                                           control.stop();
                                           return nullptr;
                                         }
                                         Batch* batch = nullptr;
                                         {
                                           const std::lock_guard lock(free_mutex);
                                           batch = free.back().release();
                                           free.pop_back();
                                         }
                                         batch->number = next;
                                         look_up(batches_[next++], *batch);
                                         return batch;
                                       }) &
            tbb::make_filter<Batch*, Batch*>(tbb::filter_mode::parallel,
                                             [&](Batch* batch) {
                                               if (!stopped(options_))
                                                 tracer_.trace(batch->missing, batch->traced);
                                               return batch;
                                             }) &
            tbb::make_filter<Batch*, void>(tbb::filter_mode::serial_in_order, [&](Batch* batch) {
              add(*batch);
              const std::lock_guard lock(free_mutex);
              free.emplace_back(batch);
            }));
    if (failed_) return Error(failure_);
    assembled_.left = thinning_.added();
    assembled_.deposits = thinning_.take();
    return std::move(assembled_);
  }

  const BakeProgress& progress() const { return progress_; }

 private:
  void look_up(const std::vector<PhotonRun>& runs, Batch& batch) {
    const std::lock_guard lock(journal_mutex_);
    batch.missing.clear();
    batch.missing_keys.clear();
    batch.found.clear();
    batch.traced.clear();
    for (const PhotonRun& run : runs) {
      if (!journals_.empty()) {
        const std::uint64_t key =
            run_key(scene_, level_.emitters[run.emitter], tracer_.emitter_key(run.emitter), run);
        const auto has_it = [&](TraceJournal& journal) {
          return journal.find(key, run, batch.found);
        };
        if (std::any_of(journals_.begin(), journals_.end(), has_it)) continue;
        batch.missing_keys.push_back(key);
      }
      if (!options_.shards.empty() && !failed_) {
        failure_ =
            "photons of emitter " + in_quotes(level_.emitters[run.emitter].name) +
            " are in none of the shards; was one left out, was it stopped before its end, or "
            "made from another level or with other settings?";
        failed_ = true;
      }
      batch.missing.push_back(run);
    }
  }

  void add(Batch& batch) {
    if (stopped(options_) || failed_) return;
    if (journal_ != nullptr && !batch.missing.empty()) {
      const std::lock_guard lock(journal_mutex_);
      if (const auto kept = journal_->append(batch.missing_keys, batch.traced); !kept.ok()) {
        failed_ = true;
        failure_ = kept.error().message;
        return;
      }
    }
    // By emitter and photon, whether found or traced.
    auto found = batch.found.runs().begin();
    auto traced = batch.traced.runs().begin();
    const auto before = [](const PhotonRun& a, const PhotonRun& b) {
      return a.emitter != b.emitter ? a.emitter < b.emitter : a.first < b.first;
    };
    std::uint64_t order = static_cast<std::uint64_t>(batch.number) * (kRunPhotons + 1);
    while (found != batch.found.runs().end() || traced != batch.traced.runs().end()) {
      if (traced == batch.traced.runs().end() ||
          (found != batch.found.runs().end() && before(found->run, traced->run))) {
        progress_.photons_reused += found->tally.photons;
        add_run(*found++, batch.found, order++);
      } else {
        progress_.bounces += traced->tally.bounces;
        add_run(*traced++, batch.traced, order++);
      }
    }
    if (options_.on_progress) options_.on_progress(progress_);
  }

  void add_run(const TracedRun& run, TracedRuns& runs, std::uint64_t order) {
    const double share = 1 / static_cast<double>(plan_.photons[run.run.emitter]);
    const auto deposits = runs.deposits().subspan(run.first_deposit, run.deposits);
    for (Source& deposit : deposits)
      for (float& power : deposit.power) power = static_cast<float>(power * share);
    if (shard_.count == 1) thinning_.add(deposits, order);
    assembled_.tally.add(run.tally, share);
    progress_.photons_done += run.tally.photons;
    progress_.escaped += run.tally.escaped;
  }

  const PhotonTracer& tracer_;
  const Level& level_;
  const BakePlan& plan_;
  const BakeOptions& options_;
  std::span<TraceJournal> journals_;
  TraceJournal* journal_;  // the one that is written, or null
  std::uint64_t scene_;
  Shard shard_;
  std::vector<std::vector<PhotonRun>> batches_;
  SourceThinning thinning_;
  Assembled assembled_;
  BakeProgress progress_;
  std::mutex journal_mutex_;
  std::atomic<bool> failed_ = false;
  std::string failure_;
};

Source emitter_source(const Emitter& emitter, std::uint32_t index, std::uint64_t key) {
  Source source;
  source.emitter = index;
  set_from_emitter(source, emitter);
  // Bounce 0 is no reflection, so the counter is free.
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
  for (const Material& material : level.materials)
    for (std::size_t b = 0; b < kBandCount; ++b)
      if (material.transmission[b] > material.absorption[b]) {
        statistics.warnings.push_back(
            "Material " + in_quotes(material.name) +
            " lets more sound through than it does not reflect (transmission above absorption); it "
            "lets through what it does not reflect.");
        break;
      }
  return statistics;
}

TraceSettings trace_settings(const BakeSettings& settings) {
  TraceSettings trace;
  trace.seed = settings.seed;
  trace.roulette_kappa = settings.roulette_kappa;
  trace.longest_path_s = settings.longest_path_s;
  trace.speed_mps = speed_of_sound_mps(settings.air);
  trace.air_loss_per_m = air_loss_per_m(settings.air);
  return trace;
}

// Everything that tracing a level needs.
struct Workshop {
  Workshop(const Level& level, const BakeSettings& settings)
      : scene(level.mesh),
        trace(trace_settings(settings)),
        plan(make_bake_plan(scene, level, settings, trace)),
        tracer(scene, level, with_least_power()) {}

  const TraceSettings& with_least_power() {
    trace.least_power = plan.least_power;
    return trace;
  }

  Scene scene;
  TraceSettings trace;
  BakePlan plan;
  PhotonTracer tracer;
};

// The journal that is written, if any, and then the shards.
Result<std::vector<TraceJournal>> open_journals(const Level& level, const BakeOptions& options) {
  std::vector<TraceJournal> journals;
  if (!options.journal.empty()) {
    auto opened = TraceJournal::open(options.journal, level.materials.size());
    if (!opened.ok()) return opened.error();
    if (!options.note.empty())
      if (const auto noted = opened->set_note(options.note); !noted.ok()) return noted.error();
    journals.push_back(std::move(*opened));
  }
  for (const std::string& shard : options.shards) {
    auto opened = TraceJournal::open_to_read(shard, level.materials.size());
    if (!opened.ok()) return opened.error();
    journals.push_back(std::move(*opened));
  }
  return journals;
}

Result<BakeContents> bake_on_this_arena(const Level& level, const BakeOptions& options,
                                        BakeReport& report) {
  const Workshop workshop(level, options.settings);
  const BakePlan& plan = workshop.plan;
  auto journals = open_journals(level, options);
  if (!journals.ok()) return journals.error();
  Tracing tracing(workshop.tracer, level, plan, options, *journals,
                  scene_hash(level, workshop.trace), {});
  auto traced = tracing.run();
  if (!traced.ok()) return traced.error();
  report.photons = tracing.progress().photons_done;
  report.photons_reused = tracing.progress().photons_reused;
  if (stopped(options)) return BakeContents{};
  if (options.on_progress) {
    BakeProgress progress = tracing.progress();
    progress.stage = "sorting";
    options.on_progress(progress);
  }

  BakeContents contents;
  contents.settings = options.settings;
  contents.settings.photons = plan.wanted_photons;
  contents.settings.sources = plan.sources;
  contents.provenance.tool = std::string("clamor ") + kVersion;
  contents.provenance.libraries = file_library_versions();
  contents.provenance.libraries.insert(contents.provenance.libraries.begin(),
                                       "Embree " + embree_version());
  contents.statistics = statistics_of(traced->tally, workshop.tracer, level);
  contents.statistics.rooms = plan.rooms;
  contents.statistics.deposits = traced->left;
  contents.materials = level.materials;
  contents.emitters = level.emitters;
  contents.signals = level.signals;
  contents.mesh = level.mesh;

  set_patch_radii(traced->deposits);
  for (Source& deposit : traced->deposits) snap_powers(deposit);
  for (std::uint32_t i = 0; i < level.emitters.size(); ++i)
    traced->deposits.push_back(
        emitter_source(level.emitters[i], i, workshop.tracer.emitter_key(i)));
  contents.octree = build_octree(std::move(traced->deposits));

  if (!options.journal.empty()) {
    TraceJournal& journal = journals->front();
    if (const auto compacted = journal.compact(); !compacted.ok())
      report.journal_warning = compacted.error().message;
    report.journal_bytes = journal.bytes();
    if (journal.damaged() > 0)
      report.journal_warning = options.journal + ": " + std::to_string(journal.damaged()) +
                               " of its records were damaged and have been traced again";
  }
  return contents;
}

Result<BakeReport> shard_on_this_arena(const Level& level, const BakeOptions& options,
                                       const Shard& shard) {
  const Workshop workshop(level, options.settings);
  auto journals = open_journals(level, options);
  if (!journals.ok()) return journals.error();
  Tracing tracing(workshop.tracer, level, workshop.plan, options, *journals,
                  scene_hash(level, workshop.trace), shard);
  if (const auto traced = tracing.run(); !traced.ok()) return traced.error();
  BakeReport report;
  report.photons = tracing.progress().photons_done;
  report.photons_reused = tracing.progress().photons_reused;
  report.journal_bytes = journals->front().bytes();
  return report;
}

// Runs it with the threads the options ask for.
template <class Work>
auto on_arena(const Level& level, const BakeOptions& options, const Work& work) {
  using Outcome = decltype(work());
  Outcome outcome = Error(
      "the level has no emitter, so there is nothing to bake; add one with --emitter "
      "\"name=violin,signal=violin.flac,at=0,1.5,0\", in LEVEL.acoustics.json or as "
      "KHR_audio_emitter");
  if (level.emitters.empty()) return outcome;
  tbb::task_arena arena(options.threads > 0 ? options.threads : tbb::task_arena::automatic);
  arena.execute([&] { outcome = work(); });
  if (outcome.ok() && stopped(options)) outcome = Error("stopped before the bake was complete");
  return outcome;
}

}  // namespace

Result<BakeContents> bake(const Level& level, const BakeOptions& options, BakeReport* report) {
  BakeReport ignored;
  return on_arena(level, options, [&] {
    return bake_on_this_arena(level, options, report != nullptr ? *report : ignored);
  });
}

Result<BakeReport> bake_shard(const Level& level, const BakeOptions& options, const Shard& shard) {
  assert(shard.index < shard.count && !options.journal.empty());
  return on_arena(level, options, [&] { return shard_on_this_arena(level, options, shard); });
}

}  // namespace clamor
