#include "bake/batch_tracing.h"

#include <algorithm>
#include <memory>

#include <tbb/parallel_pipeline.h>
#include <tbb/task_arena.h>

#include "bake/journal/run_key.h"
#include "formats/level/level.h"

namespace clamor {

// A batch in the pipeline.
struct BatchTracing::Batch {
  std::size_t number = 0;
  std::vector<PhotonRun> missing;
  std::vector<std::uint64_t> missing_keys;
  TracedRuns found, traced;
  std::vector<std::vector<ReceivedEnergy>> heard_found, heard_traced;  // per run
};

BatchTracing::BatchTracing(const PhotonTracer& tracer, const Level& level, const BakePlan& plan,
                           const BakeOptions& options, std::span<TraceJournal> journals,
                           std::uint64_t scene, const Shard& shard, DecayEstimate* decay)
    : tracer_(tracer),
      level_(level),
      plan_(plan),
      options_(options),
      journals_(journals),
      journal_(options.journal.empty() ? nullptr : &journals.front()),
      scene_(scene),
      shard_(shard),
      decay_(decay),
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

Result<BatchTracing::Assembled> BatchTracing::run() {
  const std::size_t at_once = 4 * static_cast<std::size_t>(tbb::this_task_arena::max_concurrency());
  std::vector<std::unique_ptr<Batch>> free;
  for (std::size_t i = 0; i < at_once; ++i) free.push_back(std::make_unique<Batch>());
  std::size_t next = 0;
  std::mutex free_mutex;
  tbb::parallel_pipeline(
      at_once,
      tbb::make_filter<void, Batch*>(tbb::filter_mode::serial_in_order,
                                     [&](tbb::flow_control& control) -> Batch* {
                                       if (next == batches_.size() || stopped() || failed_) {
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
                                             if (stopped()) return batch;
                                             tracer_.trace(batch->missing, batch->traced);
                                             hear(batch->found, batch->heard_found);
                                             hear(batch->traced, batch->heard_traced);
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

void BatchTracing::look_up(const std::vector<PhotonRun>& runs, Batch& batch) {
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
      failure_ = "photons of emitter " + in_quotes(level_.emitters[run.emitter].name) +
                 " are in none of the shards; was one left out, was it stopped before its end, or "
                 "made from another level or with other settings?";
      failed_ = true;
    }
    batch.missing.push_back(run);
  }
}

void BatchTracing::hear(const TracedRuns& runs,
                        std::vector<std::vector<ReceivedEnergy>>& heard) const {
  heard.resize(runs.runs().size());
  for (std::size_t i = 0; i < heard.size(); ++i) {
    heard[i].clear();
    const TracedRun& run = runs.runs()[i];
    if (decay_ != nullptr && decay_->wants(run.run))
      decay_->hear(runs.deposits().subspan(run.first_deposit, run.deposits),
                   runs.photons().subspan(run.first_deposit, run.deposits), heard[i]);
  }
}

void BatchTracing::add(Batch& batch) {
  if (stopped() || failed_) return;
  if (journal_ != nullptr && !batch.missing.empty()) {
    const std::lock_guard lock(journal_mutex_);
    if (const auto kept = journal_->append(batch.missing_keys, batch.traced); !kept.ok()) {
      failed_ = true;
      failure_ = kept.error().message;
      return;
    }
  }
  // Merges found and traced runs in the order of emitters and photons.
  auto found = batch.found.runs().begin();
  auto traced = batch.traced.runs().begin();
  const auto before = [](const PhotonRun& a, const PhotonRun& b) {
    return a.emitter != b.emitter ? a.emitter < b.emitter : a.first < b.first;
  };
  const auto index = [](const TracedRuns& runs, auto run) {
    return static_cast<std::size_t>(run - runs.runs().begin());
  };
  std::uint64_t order = static_cast<std::uint64_t>(batch.number) * (kRunPhotons + 1);
  while (found != batch.found.runs().end() || traced != batch.traced.runs().end()) {
    if (traced == batch.traced.runs().end() ||
        (found != batch.found.runs().end() && before(found->run, traced->run))) {
      progress_.photons_reused += found->tally.photons;
      add_run(*found, batch.found, order++, batch.heard_found[index(batch.found, found)]);
      ++found;
    } else {
      progress_.bounces += traced->tally.bounces;
      add_run(*traced, batch.traced, order++, batch.heard_traced[index(batch.traced, traced)]);
      ++traced;
    }
  }
  if (!options_.on_progress) return;
  if (decay_ != nullptr && progress_.photons_done >= next_error_) {
    progress_.error_db = decay_->error_db().value_or(0);
    next_error_ = progress_.photons_done + progress_.photons_done / 8;
  }
  options_.on_progress(progress_);
}

void BatchTracing::add_run(const TracedRun& run, TracedRuns& runs, std::uint64_t order,
                           std::span<const ReceivedEnergy> heard) {
  if (decay_ != nullptr && decay_->wants(run.run)) decay_->add(run.run, heard);
  const double share = 1 / static_cast<double>(plan_.photons[run.run.emitter]);
  const auto deposits = runs.deposits().subspan(run.first_deposit, run.deposits);
  for (Source& deposit : deposits)
    for (float& power : deposit.power) power = static_cast<float>(power * share);
  if (shard_.count == 1) thinning_.add(deposits, order);
  assembled_.tally.add(run.tally, share);
  progress_.photons_done += run.tally.photons;
  progress_.escaped += run.tally.escaped;
}

}  // namespace clamor
