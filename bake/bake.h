// bake.h: bakes a level into the contents of a bake file.
//
//   Level -> Scene (Embree) -> BakePlan -> photons -> SourceThinning -> patch radii -> SourceOctree
#pragma once

#include <cstdint>
#include <string>

#include "bake/bake_options.h"
#include "common/result.h"
#include "formats/bake_file/bake_contents.h"

namespace clamor {

struct Level;

// Results of a bake that are not part of its contents.
struct BakeReport {
  std::uint64_t photons = 0;  // all photons of the bake
  std::uint64_t photons_reused = 0;
  std::uint64_t journal_runs = 0;  // runs in the journal before the bake
  std::uint64_t journal_bytes = 0;
  // Sources that instances represent. Their prototypes are part of the contents.
  std::uint64_t instanced_sources = 0;
  std::size_t instanced_groups = 0, instance_prototypes = 0;
  std::uint64_t probe_photons = 0;  // on top of `photons`
  bool exceeds_memory = false;      // it failed because it would need more than memory_bytes
  bool is_reweighed = false;        // photons of a path cache were used
  std::string why_traced;           // why they were not, if BakeOptions::reweighs is set
  std::string journal_warning;  // why the journal could not be used or was partly damaged, or ""
};

// Traces the level. Sets provenance.tool and the statistics; the caller sets provenance.level and
// input_hash. A level without triangles is a free field; one without emitters and probes is an
// Error. Photons are traced in fixed batches that are joined in order, so the result does not
// depend on the number of threads. Memory grows with the kept sources, not with the photons.
Result<BakeContents> bake(const Level& level, const BakeOptions& options,
                          BakeReport* report = nullptr);

// Traces one shard into options.journal. bake() with all shards in options.shards, in any order,
// gives the same contents as an unsharded bake.
Result<BakeReport> bake_shard(const Level& level, const BakeOptions& options, const Shard& shard);

// What a bake will take, for those who share it out among machines.
struct BakeCost {
  BakeSettings settings;  // with the numbers of photons and sources of the plan
  std::uint64_t triangles = 0;
  std::uint64_t photons = 0;             // of the emitters and probes, in all states of the level
  double photons_per_core_s = 0;         // 0 if there are none
  double bytes_per_photon = 0;           // in a shard
  double preparing_s = 0;                // of each process, before its first photon
  std::uint64_t shard_memory_bytes = 0;  // of a shard on one thread, and for each further thread
  std::uint64_t thread_memory_bytes = 0;
  std::uint64_t merge_memory_bytes = 0;
};

// Measures by tracing some of the photons on one thread, for about a second.
Result<BakeCost> bake_cost(const Level& level, const BakeOptions& options);

}  // namespace clamor
