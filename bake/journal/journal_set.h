// journal_set.h: the journals of one bake: the one that it writes, and the shards that it reads.
//
// Threads: any; a mutex serialises the calls.
#pragma once

#include <cstdint>
#include <mutex>
#include <span>
#include <vector>

#include "bake/journal/trace_journal.h"
#include "bake/trace/photon_tracer.h"
#include "common/result.h"

namespace clamor {

struct Level;

class JournalSet {
 public:
  // `writes`: whether the first of `journals` receives new runs. `scene` is scene_hash(). Level,
  // tracer and journals must outlive the object.
  JournalSet(std::span<TraceJournal> journals, bool writes, const Level& level,
             const PhotonTracer& tracer, std::uint64_t scene);

  // Appends the runs that a journal contains to `found` and the others to `missing`.
  void find(std::span<const PhotonRun> runs, TracedRuns& found, std::vector<PhotonRun>& missing);

  // Writes traced runs to the first journal, if that is to be written.
  Result<void> append(const TracedRuns& traced);

  // Tells the journal that is written the error of the energy decay so far.
  void set_error_db(double error_db);

 private:
  std::uint64_t key_of(const PhotonRun& run) const;
  bool find_one(const PhotonRun& run, TracedRuns& found);

  std::span<TraceJournal> journals_;
  bool writes_;
  const Level& level_;
  const PhotonTracer& tracer_;
  std::uint64_t scene_;
  std::size_t last_found_ = 0;  // index of the journal that had the last run
  std::mutex mutex_;
};

}  // namespace clamor
