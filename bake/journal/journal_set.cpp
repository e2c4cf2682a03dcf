#include "bake/journal/journal_set.h"

#include <cstdint>

#include "formats/level/emitter.h"

namespace clamor {

// Consecutive runs are in one shard or in consecutive ones. One record is kept in memory, not one
// for each shard.
Result<bool> JournalSet::find(const PhotonRun& run, TracedRuns& found) {
  const std::uint64_t key = keys_.of(run);
  std::vector<TraceJournal>& list = journals_.list;
  for (std::size_t i = 0; i < list.size(); ++i) {
    const std::size_t at = (last_found_ + i) % list.size();
    if (!list[at].find(key, run, found)) continue;
    if (at != last_found_) list[last_found_].release();
    last_found_ = at;
    return true;
  }
  if (journals_.has_all)
    return Error("photons of emitter " + in_quotes(keys_.emitter_of(run).name) +
                 " are in none of the shards; was one left out, was it stopped before its end, or "
                 "made from another level or with other settings?");
  return false;
}

Result<void> JournalSet::record(const TracedRuns& traced) {
  if (!journals_.writes || traced.runs().empty()) return {};
  return journals_.list.front().append(keys_.of_all(traced), traced);
}

void JournalSet::set_error_db(double error_db) {
  if (journals_.writes) journals_.list.front().set_error_db(error_db);
}

}  // namespace clamor
