// bake_options.h: what a bake is asked for, and how far it is.
#pragma once

#include <atomic>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "bake/journal/shard_note.h"
#include "common/vec.h"
#include "formats/bake_file/bake_metadata.h"
#include "formats/level/scene_group.h"

namespace clamor {

class PathCache;  // bake/path_cache.h

inline constexpr std::uint32_t kProbeSources = 1600, kMaxProbeSources = 1'000'000;

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
  int threads = 0;                  // 0: all cores; the result does not depend on it
  std::uint64_t memory_bytes = 0;   // memory limit, checked before tracing starts; 0: none
  std::string journal{};            // journal file (trace_journal.h); "": none
  std::string spill{};              // prefix of temporary files for sorting; "": none allowed
  std::optional<ShardNote> note{};  // stored in the journal of a shard
  bool tells_progress = false;      // stores the progress in the journal, once a second
  // Places of probes, and the early secondary sources that each keeps (probe_tracing.h).
  std::vector<Vec3> probes_m{};
  std::uint32_t probe_sources = kProbeSources;
  SceneGroups groups{};  // groups of the level's emitters; congruent ones become instances
  // Re-weighs the photons of this cache instead of tracing, where it can; null: traces.
  const PathCache* reweighs = nullptr;
  // Keeps all photons and their paths here, and finds those of earlier bakes; null: none. The plan
  // then depends on them a little (keep_estimates()). The journal is used where the cache is full.
  // Without effect for bakes with probes or with portals that are baked closed.
  PathCache* keeps_paths = nullptr;
  // Journals that together contain all photons; nothing is traced.
  std::vector<std::string> shards{};
  // Called from any thread, one call at a time.
  std::function<void(const BakeProgress&)> on_progress{};
  // Set it to cancel the bake, which then returns an Error.
  const std::atomic<bool>* stop = nullptr;
  bool is_stopped() const { return stop != nullptr && stop->load(std::memory_order_relaxed); }
};

// Shard `index` of `count`, from 0, consists of one in `count` batches of photons.
struct Shard {
  std::uint32_t index = 0, count = 1;
};

}  // namespace clamor
