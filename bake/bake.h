// bake.h: from a level to the contents of a bake file.
//
//   Level -> Scene (Embree) -> BakePlan -> photons -> SourceThinning -> patch radii -> SourceOctree
#pragma once

#include <atomic>
#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "common/result.h"
#include "formats/bake_file/bake_file.h"
#include "formats/level/level.h"
#include "formats/level/scene_group.h"

namespace clamor {

struct BakeProgress {
  const char* stage = "";
  std::uint64_t photons_done = 0, photons_total = 0;
  std::uint64_t photons_reused = 0;  // of those done, taken from the journal
  std::uint64_t bounces = 0;         // of those traced
  std::uint64_t escaped = 0;         // of those done
  double error_db = 0;               // of the energy decay so far; 0: too early to tell
};

struct BakeOptions {
  BakeSettings settings{};
  int threads = 0;  // 0: all cores; never changes a byte
  std::uint64_t memory_bytes =
      0;                  // a bake that would take more is an Error before it starts; 0: any
  std::string journal{};  // file that keeps what is traced, see trace_journal.h; "" for none
  std::string spill{};    // where sorting needs files, they are beside this one; "" for nowhere
  std::string note{};     // kept in the journal for whoever merges it
  SceneGroups
      groups{};  // of the level's emitters; where they are alike, copies of them are written
  std::vector<std::string> shards{};  // journals that together hold all photons: none is traced
  std::function<void(const BakeProgress&)> on_progress{};  // from any thread, one at a time
  const std::atomic<bool>* stop = nullptr;                 // set it to end the bake with an Error
};

// Part `index` of `count`, from 0: every count-th batch of photons.
struct Shard {
  std::uint32_t index = 0, count = 1;
};

// What happened besides the result.
struct BakeReport {
  std::uint64_t photons = 0;  // done in all
  std::uint64_t photons_reused = 0;
  std::uint64_t journal_runs = 0;  // that the journal held before
  std::uint64_t journal_bytes = 0;
  std::uint64_t instanced_sources =
      0;  // in copies; those of the trees they copy are in the contents
  std::size_t instanced_groups = 0, instance_prototypes = 0;
  std::string journal_warning;  // why the journal was not used, or what of it was damaged; or ""
};

// Traces the level. provenance.tool and statistics are filled in; provenance.level and input_hash
// are the caller's. A level without triangles is a free field; one without emitters is an Error.
// Photons are traced in batches of a fixed make-up that are joined in order, so that neither
// sources nor sums depend on the number of threads; memory grows with the sources kept, not with
// photons.
Result<BakeContents> bake(const Level& level, const BakeOptions& options,
                          BakeReport* report = nullptr);

// Traces one shard into options.journal. The shards of a bake, given to bake() as options.shards in
// any order, make the same contents as a bake of the whole.
Result<BakeReport> bake_shard(const Level& level, const BakeOptions& options, const Shard& shard);

}  // namespace clamor
