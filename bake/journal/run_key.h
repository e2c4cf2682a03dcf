// run_key.h: all that a run of photons depends on, in one number.
//
// Equal keys mean equal results, so what was traced under a key need never be traced again
// (trace_journal.h). Whatever changes what the tracer does changes kTraceVersion in run_key.cpp.
#pragma once

#include <cstdint>

#include "bake/trace/photon_tracer.h"
#include "formats/level/level.h"

namespace clamor {

// Hashes mesh, materials and settings.
std::uint64_t scene_hash(const Level& level, const TraceSettings& settings);

// The key of a run. `scene` is scene_hash(), `emitter_key` PhotonTracer::emitter_key().
std::uint64_t run_key(std::uint64_t scene, const Emitter& emitter, std::uint64_t emitter_key,
                      const PhotonRun& run);

}  // namespace clamor
