// path_cache.h: keeps traced photons and their paths in memory, for the next bakes of a level that
// is being edited.
//
// Photons are re-weighed when only absorption has changed (reweighed_photons.h). When an emitter
// has changed, the runs of the others are found by their keys, as in a journal (run_key.h). A
// journal keeps no paths, so that it only serves where the cache is full.
//
// Threads: one at a time; const functions may be called concurrently. Memory: 96 bytes for each
// deposit, 8 for each reflection and 40 for each power without a deposit, with a bound; re-weighed
// deposits are copies.
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <memory>
#include <span>
#include <unordered_map>
#include <utility>
#include <vector>

#include "bake/bake_plan.h"
#include "bake/journal/run_key.h"
#include "bake/kept_run.h"
#include "bake/reweighed_photons.h"
#include "bake/trace/run_source.h"
#include "common/material.h"
#include "common/result.h"
#include "formats/bake_file/bake_metadata.h"

namespace clamor {

struct Level;

class PathCache {
 public:
  static constexpr std::uint64_t kMaxBytes = 256'000'000;
  // In the violin room and Sponza, edits that left 100 deposits gave the decay times of fresh bakes
  // within the error of both, and those that left 20 gave up to a third less.
  static constexpr double kMinDeposits = 64;

  // `min_deposits`: see enough_deposits(); 0 for any number.
  explicit PathCache(std::uint64_t max_bytes = kMaxBytes, double min_deposits = kMinDeposits)
      : max_bytes_(max_bytes), min_deposits_(min_deposits) {}

  // Begins with the runs of a bake. `trace` are its complete settings, `scene` is their
  // scene_hash(). Runs of the bakes before may be found until it has all of its own.
  void begin(const Level& level, const BakeSettings& settings, const BakePlan& plan,
             const TraceSettings& trace, std::uint64_t scene);
  // Appends a run of an earlier bake to `found`, or returns false.
  bool find(std::uint64_t key, const PhotonRun& run, TracedRuns& found);
  // Takes runs with recorded paths. Returns false if they are too many; the cache is full then.
  bool add(std::span<const std::uint64_t> keys, const TracedRuns& traced);

  // A full cache has no runs, and takes none until another scene begins.
  bool is_full() const { return is_full_; }

  // The plan of the last bake.
  const BakePlan& plan() const { return plan_; }

  // The photons in a level that differs from that of begin() in absorption alone. Fails, with a
  // reason for people, if it differs in more, if paths are missing or too short for the new decay,
  // or if the variance would be too high. Uses the caller's team.
  Result<ReweighedPhotons> reweigh(const Level& level, const BakeSettings& settings) const;

  std::uint64_t bytes() const { return bytes_; }

 private:
  struct Entry {
    std::uint64_t key = 0;
    KeptRun run;
  };

  void put(std::uint64_t key, KeptRun run);
  void forget_earlier();

  std::uint64_t max_bytes_;
  double min_deposits_;
  std::uint64_t bytes_ = 0;
  bool is_full_ = false;
  std::uint64_t scene_ = 0;
  std::uint64_t paths_ = 0;  // hash of everything but the absorption
  std::vector<Material> materials_;
  BakePlan plan_;
  std::shared_ptr<const ImageIndex> images_;
  std::size_t all_runs_ = 0;                                       // of the plan
  std::map<std::pair<std::uint32_t, std::uint64_t>, Entry> runs_;  // by emitter and first photon
  std::unordered_map<std::uint64_t, KeptRun> earlier_;             // of bakes before, by key
};

// The runs of a bake that keeps its paths.
class KeptPaths final : public RunSource {
 public:
  // The cache has begun with the bake. `journals` serve where it is full. All must outlive the
  // object.
  KeptPaths(PathCache& cache, RunSource& journals, const RunKeys& keys)
      : cache_(cache), journals_(journals), keys_(keys) {}

  Result<bool> find(const PhotonRun& run, TracedRuns& found) override;
  Result<void> record(const TracedRuns& traced) override;
  bool records_paths() const override { return !cache_.is_full(); }

 private:
  PathCache& cache_;
  RunSource& journals_;
  const RunKeys keys_;
};

}  // namespace clamor
