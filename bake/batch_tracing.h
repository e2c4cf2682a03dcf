// batch_tracing.h: produces all photons of a bake, from the journal or by tracing, and thins them.
//
// Photons form fixed batches, which pass through a pipeline: look up in the journal (in order),
// trace (in parallel, in any order), accumulate (in order). Neither sources nor sums therefore
// depend on the number of threads or on the contents of the journal.
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

namespace clamor {

struct Level;

class BatchTracing {
 public:
  // The accumulated result of all batches.
  struct Assembled {
    std::vector<Source> deposits;  // thinned to the plan's number of sources; empty for a shard
    TraceTally tally;
    std::uint64_t left = 0;  // deposits before thinning
  };

  // If options.journal is set, it is the first of `journals` and receives what is traced. If
  // options.shards is set, nothing is traced. `scene` is scene_hash(). `decay` may be null;
  // otherwise it receives every run. All arguments must outlive the object.
  BatchTracing(const PhotonTracer& tracer, const Level& level, const BakePlan& plan,
               const BakeOptions& options, std::span<TraceJournal> journals, std::uint64_t scene,
               const Shard& shard, DecayEstimate* decay = nullptr);

  // Runs in the calling TBB arena. Fails if the journal cannot be written or if shards lack
  // photons. Returns a partial result when options.stop is set.
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
  TraceJournal* journal_;  // the journal to append to, or null
  std::uint64_t scene_;
  Shard shard_;
  DecayEstimate* decay_;
  std::uint64_t next_error_ = 0;  // photon count for the next error estimate
  std::vector<std::vector<PhotonRun>> batches_;
  SourceThinning thinning_;
  Assembled assembled_;
  BakeProgress progress_;
  std::mutex journal_mutex_;
  std::atomic<bool> failed_ = false;
  std::string failure_;
};

}  // namespace clamor
