// bake.h: bakes a level into the contents of a bake file.
//
//   Level -> Scene (Embree) -> BakePlan -> photons -> SourceThinning -> patch radii -> SourceOctree
#pragma once

#include <atomic>
#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "common/result.h"
#include "formats/bake_file/bake_contents.h"
#include "formats/level/scene_group.h"

namespace clamor {

struct Level;

struct BakeProgress {
  const char* stage = "";
  std::uint64_t photons_done = 0, photons_total = 0;
  std::uint64_t photons_reused = 0;  // photons taken from the journal
  std::uint64_t bounces = 0;         // bounces of the traced photons
  std::uint64_t escaped = 0;         // photons that left the level
  double error_db = 0;               // error of the energy decay so far; 0: not yet known
};

struct BakeOptions {
  BakeSettings settings{};
  int threads = 0;                 // 0: all cores; the result does not depend on it
  std::uint64_t memory_bytes = 0;  // memory limit, checked before tracing starts; 0: none
  std::string journal{};           // journal file (trace_journal.h); "": none
  std::string spill{};             // prefix of temporary files for sorting; "": none allowed
  std::string note{};              // text stored in the journal, for merging shards
  SceneGroups groups{};  // groups of the level's emitters; congruent ones become instances
  // Journals that together contain all photons; nothing is traced.
  std::vector<std::string> shards{};
  // Called from any thread, one call at a time.
  std::function<void(const BakeProgress&)> on_progress{};
  // Set it to cancel the bake, which then returns an Error.
  const std::atomic<bool>* stop = nullptr;
};

// Shard `index` of `count`, from 0, consists of every count-th batch of photons.
struct Shard {
  std::uint32_t index = 0, count = 1;
};

// Results of a bake that are not part of its contents.
struct BakeReport {
  std::uint64_t photons = 0;  // all photons of the bake
  std::uint64_t photons_reused = 0;
  std::uint64_t journal_runs = 0;  // runs in the journal before the bake
  std::uint64_t journal_bytes = 0;
  // Sources that instances represent. Their prototypes are part of the contents.
  std::uint64_t instanced_sources = 0;
  std::size_t instanced_groups = 0, instance_prototypes = 0;
  std::string journal_warning;  // why the journal could not be used or was partly damaged, or ""
};

// Traces the level. Sets provenance.tool and the statistics; the caller sets provenance.level and
// input_hash. A level without triangles is a free field; one without emitters is an Error. Photons
// are traced in fixed batches that are joined in order, so the result does not depend on the number
// of threads. Memory grows with the kept sources, not with the photons.
Result<BakeContents> bake(const Level& level, const BakeOptions& options,
                          BakeReport* report = nullptr);

// Traces one shard into options.journal. bake() with all shards in options.shards, in any order,
// gives the same contents as an unsharded bake.
Result<BakeReport> bake_shard(const Level& level, const BakeOptions& options, const Shard& shard);

}  // namespace clamor
