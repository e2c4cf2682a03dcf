#include "bake/trace_pass.h"

#include <optional>

#include "bake/journal/run_key.h"
#include "bake/path_cache.h"

namespace clamor {

Result<BatchTracing::Output> trace_pass(const TracePass& pass, const BakePasses& passes) {
  const TraceSettings& trace = pass.tracer.settings();
  const RunKeys keys(pass.emitters, pass.tracer, scene_hash(pass.surfaces, trace));
  JournalSet journals(passes.journals, keys);
  std::optional<KeptPaths> kept;
  RunSource* source = passes.reweighed != nullptr ? passes.reweighed : &journals;
  if (passes.kept != nullptr) {
    passes.kept->begin(pass.surfaces, passes.options.settings, pass.plan, trace, keys.scene());
    source = &kept.emplace(*passes.kept, journals, keys);
  }
  BatchTracing tracing(pass.tracer, pass.plan, passes.options, *source, passes.shard, pass.decay,
                       pass.sink);
  tracing.name_stage(pass.stage);
  if (passes.thins_in_file)
    if (const auto ready = tracing.thin_in_file(passes.options.spill); !ready.ok())
      return ready.error();
  auto traced = tracing.run();
  if (!traced.ok()) return traced;
  const BakeProgress& done = tracing.progress();
  (pass.sink ? passes.report.probe_photons : passes.report.photons) += done.photons_done;
  passes.report.photons_reused += done.photons_reused;
  return traced;
}

}  // namespace clamor
