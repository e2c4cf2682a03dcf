// batch_tracing.h: gets all photons of a bake, from a source of traced runs or by tracing, and
// thins their deposits to the sources of the file.
//
// A batch is one or more runs, of at most 1024 photons together. Batches are fixed by the plan, and
// pass through a pipeline: look up in the source (in order), trace (in parallel, in any order),
// accumulate (in order). Neither sources nor sums therefore depend on the number of threads or on
// which runs were found.
#pragma once

#include <array>
#include <atomic>
#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "bake/bake_options.h"
#include "bake/bake_plan.h"
#include "bake/octree/scratch_list.h"
#include "bake/octree/source_thinning.h"
#include "bake/portals/portal_sets.h"
#include "bake/report/decay_estimate.h"
#include "bake/trace/photon_tracer.h"
#include "bake/trace/run_source.h"
#include "common/result.h"

namespace clamor {

class BatchTracing {
 public:
  // The accumulated result of all batches.
  struct Output {
    // Thinned to the plan's number; empty for a shard or with a sink. Those whose sound passed
    // portals have provisional emitters of `portals`.
    ScratchList<Source> sources;
    PortalPairs portals{0};
    TraceTally tally;
    std::vector<std::array<double, kBandCount>> power_arrived;  // by material of the level
    std::uint64_t deposits = 0;                                 // before thinning; 0 for a shard
    BakeProgress progress;                                      // at the end
  };

  // Receives runs in order, in place of the thinning.
  using RunSink = std::function<void(const TracedRun& run, std::span<const Deposit> deposits)>;

  // `decay` may be null; otherwise it receives the runs that it wants. All arguments must outlive
  // the object.
  BatchTracing(const PhotonTracer& tracer, const BakePlan& plan, const BakeOptions& options,
               RunSource& source, const Shard& shard, DecayEstimate* decay = nullptr,
               RunSink sink = {});

  // Keeps the sources in a file. Call before run().
  Result<void> thin_in_file(const std::string& beside);

  // Names the stage in the progress, instead of "tracing".
  void name_stage(const char* stage) { progress_.stage = stage; }

  // Runs on the caller's team. Fails if the source does, which then lacks photons or cannot
  // record them, and when options.stop is set.
  Result<Output> run();

  const BakeProgress& progress() const { return progress_; }

 private:
  struct Batch;
  using DecayEnergies = std::vector<std::vector<ReceivedEnergy>>;  // per run

  bool stopped() const { return options_.is_stopped(); }
  void look_up(Batch& batch);
  DecayEnergies measure_decay(const TracedRuns& runs) const;
  void accumulate(Batch& batch);
  void accumulate_run(const TracedRun& run, std::span<const Deposit> deposits,
                      std::span<const ReceivedEnergy> received);
  void fail(std::string message);

  const PhotonTracer& tracer_;
  const BakePlan& plan_;
  const BakeOptions& options_;
  RunSource& source_;
  std::mutex source_mutex_;  // stages of the pipeline overlap
  DecayEstimate* decay_;
  const RunSink sink_;
  std::vector<std::vector<PhotonRun>> batches_;  // of this shard
  std::optional<SourceThinning> thinning_;       // not for a shard or with a sink
  std::vector<Source> sources_;                  // of the current run
  PortalPairs portals_;
  TraceTally tally_;
  std::vector<std::array<double, kBandCount>> power_arrived_;
  BakeProgress progress_;
  std::uint64_t next_error_ = 0;  // photon count for the next error estimate
  std::atomic<bool> failed_ = false;
  std::string failure_;
};

}  // namespace clamor
