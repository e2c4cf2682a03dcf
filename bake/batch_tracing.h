// batch_tracing.h: all photons of a bake, from the journal or traced, to the sources that are kept.
//
// Photons come in batches of a fixed make-up. Batches pass through a pipeline: looked up in order,
// traced in any order on all threads, added in order; so neither sources nor sums depend on the
// number of threads, nor on what was in the journal.
#pragma once

#include <atomic>
#include <cstdint>
#include <mutex>
#include <span>
#include <string>
#include <vector>

#include "bake/bake.h"
#include "bake/bake_plan.h"
#include "bake/journal/trace_journal.h"
#include "bake/octree/source_thinning.h"
#include "bake/report/decay_estimate.h"
#include "bake/trace/photon_tracer.h"
#include "common/result.h"
#include "formats/level/level.h"

namespace clamor {

class BatchTracing {
 public:
  // What all batches left behind.
  struct Assembled {
    std::vector<Source> deposits;  // thinned to the plan's sources; none where it is a shard
    TraceTally tally;
    std::uint64_t left = 0;  // deposits before thinning
  };

  // If options.journal is named, it is the first of `journals`, and what is traced is added to it.
  // If options.shards are named, nothing is traced. `scene` is scene_hash(). `decay`, unless null,
  // is told what is traced or found. All must outlive this.
  BatchTracing(const PhotonTracer& tracer, const Level& level, const BakePlan& plan,
               const BakeOptions& options, std::span<TraceJournal> journals, std::uint64_t scene,
               const Shard& shard, DecayEstimate* decay = nullptr);

  // Runs on the arena it is called from. An Error if the journal cannot be written, or if shards
  // lack photons. Returns early, with less, when options.stop is set.
  Result<Assembled> run();

  const BakeProgress& progress() const { return progress_; }

 private:
  struct Batch;

  bool stopped() const {
    return options_.stop != nullptr && options_.stop->load(std::memory_order_relaxed);
  }
  void look_up(const std::vector<PhotonRun>& runs, Batch& batch);
  void add(Batch& batch);
  void hear(const TracedRuns& runs, std::vector<std::vector<ReceivedEnergy>>& heard) const;
  void add_run(const TracedRun& run, TracedRuns& runs, std::uint64_t order,
               std::span<const ReceivedEnergy> heard);

  const PhotonTracer& tracer_;
  const Level& level_;
  const BakePlan& plan_;
  const BakeOptions& options_;
  std::span<TraceJournal> journals_;
  TraceJournal* journal_;  // the one that is written, or null
  std::uint64_t scene_;
  Shard shard_;
  DecayEstimate* decay_;
  std::uint64_t next_error_ = 0;  // photons at which the error is estimated again
  std::vector<std::vector<PhotonRun>> batches_;
  SourceThinning thinning_;
  Assembled assembled_;
  BakeProgress progress_;
  std::mutex journal_mutex_;
  std::atomic<bool> failed_ = false;
  std::string failure_;
};

}  // namespace clamor
