// trace_pass.h: one pass over a plan of photons. The emitters of the level as it is, those of the
// level with closed portals, and the probes of both are passes of one function.
#pragma once

#include "bake/bake.h"
#include "bake/batch_tracing.h"
#include "bake/journal/journal_set.h"
#include "bake/traced_state.h"
#include "common/result.h"

namespace clamor {

// The options, journals and report that all passes of a bake share.
struct BakePasses {
  const BakeOptions& options;
  OpenJournals& journals;
  BakeReport& report;  // receives the numbers of photons
  const Shard shard{};
  RunSource* reweighed = nullptr;  // has the photons of the only pass; null: none
  PathCache* kept = nullptr;       // keeps the photons of the only pass; null: none
  bool thins_in_file = false;      // needs options.spill
};

struct TracePass {
  const char* stage;      // for the progress
  const Level& surfaces;  // with the mesh that is traced
  const Level& emitters;  // those of the plan
  const PhotonTracer& tracer;
  const BakePlan& plan;
  DecayEstimate* decay = nullptr;  // see BatchTracing
  BatchTracing::RunSink sink = {};
};

// Runs on the caller's team. Fails when it is stopped.
Result<BatchTracing::Output> trace_pass(const TracePass& pass, const BakePasses& passes);

}  // namespace clamor
