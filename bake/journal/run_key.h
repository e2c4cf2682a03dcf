// run_key.h: hashes everything that the result of a photon run depends on.
//
// Equal keys imply equal results, so a run that is stored under its key (trace_journal.h) need not
// be traced again. Every change of the tracer's results must increment kTraceVersion in
// run_key.cpp.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

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

// The keys of the runs that a tracer traces.
class RunKeys {
 public:
  // `scene` is scene_hash(). `level` has the emitters. Level and tracer must outlive the object.
  RunKeys(const Level& level, const PhotonTracer& tracer, std::uint64_t scene);

  std::uint64_t of(const PhotonRun& run) const;
  std::vector<std::uint64_t> of_all(const TracedRuns& traced) const;
  std::uint64_t scene() const { return scene_; }
  const Emitter& emitter_of(const PhotonRun& run) const;

 private:
  const Level* level_;
  const PhotonTracer* tracer_;
  std::uint64_t scene_;
};

}  // namespace clamor
