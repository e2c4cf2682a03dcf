// run_source.h: where a bake may find runs of photons that it need not trace.
//
// Batch tracing (bake/batch_tracing.h) asks for each run, in the order of the plan, traces those
// that the source does not have, and hands them to it, so that a later bake finds them.
//
//   JournalSet         journals on disk, and the shards of a merge (bake/journal/journal_set.h)
//   KeptPaths          runs in memory with their paths, for re-weighing later (bake/path_cache.h)
//   ReweighedPhotons   all runs of an earlier bake, re-weighed (bake/reweighed_photons.h)
//
// Threads: any; one call at a time.
#pragma once

#include "bake/trace/photon_tracer.h"
#include "common/result.h"

namespace clamor {

class RunSource {
 public:
  virtual ~RunSource() = default;

  // Appends the run to `found` and returns true, or returns false if it has to be traced. Fails if
  // it is missing and must not be traced.
  virtual Result<bool> find(const PhotonRun& run, TracedRuns& found) = 0;

  // Takes runs that have been traced, in the order of the plan.
  virtual Result<void> record(const TracedRuns& traced) = 0;

  // Whether record() needs the paths of the runs that are traced next.
  virtual bool records_paths() const { return false; }

  // Whether it has all runs in memory. The progress then has no error of the energy decay, since
  // estimating it would take longer than the bake.
  virtual bool is_instant() const { return false; }

  // Takes the error of the energy decay from the photons so far.
  virtual void set_error_db(double /*error_db*/) {}
};

}  // namespace clamor
