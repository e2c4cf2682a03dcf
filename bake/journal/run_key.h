// run_key.h: hashes everything that the result of a photon run depends on.
//
// Equal keys imply equal results, so a run that is stored under its key (trace_journal.h) need not
// be traced again. Every change of the tracer's results must increment kTraceVersion in
// run_key.cpp.
#pragma once

#include <cstdint>
#include <string>

#include "bake/trace/photon_tracer.h"

namespace clamor {

struct BakeSettings;
struct Emitter;
struct Level;

// The version of the tracer's results.
std::string trace_version();

// Hash of mesh, materials and settings.
std::uint64_t scene_hash(const Level& level, const TraceSettings& settings);

// Hash of everything that decides the directions of a bake's photons: all of the level that is
// traced, except for the absorption of its materials.
std::uint64_t paths_hash(const Level& level, const BakeSettings& settings);

// Key of a run. `scene` is scene_hash(), `emitter_key` is PhotonTracer::emitter_key().
std::uint64_t run_key(std::uint64_t scene, const Emitter& emitter, std::uint64_t emitter_key,
                      const ImageIndex* images, const PhotonRun& run);

}  // namespace clamor
