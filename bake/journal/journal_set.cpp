#include "bake/journal/journal_set.h"

#include "bake/journal/run_key.h"
#include "formats/level/level.h"

namespace clamor {

JournalSet::JournalSet(std::span<TraceJournal> journals, bool writes, const Level& level,
                       const PhotonTracer& tracer, std::uint64_t scene)
    : journals_(journals), writes_(writes), level_(level), tracer_(tracer), scene_(scene) {}

std::uint64_t JournalSet::key_of(const PhotonRun& run) const {
  return run_key(scene_, level_.emitters[run.emitter], tracer_.emitter_key(run.emitter),
                 tracer_.settings().images.get(), run);
}

void JournalSet::find(std::span<const PhotonRun> runs, TracedRuns& found,
                      std::vector<PhotonRun>& missing) {
  if (journals_.empty()) {
    missing.insert(missing.end(), runs.begin(), runs.end());
    return;
  }
  const std::lock_guard lock(mutex_);
  for (const PhotonRun& run : runs)
    if (!find_one(run, found)) missing.push_back(run);
}

// Consecutive runs are in one shard or in consecutive ones. One record is kept in memory, not one
// for each shard.
bool JournalSet::find_one(const PhotonRun& run, TracedRuns& found) {
  const std::uint64_t key = key_of(run);
  for (std::size_t i = 0; i < journals_.size(); ++i) {
    const std::size_t at = (last_found_ + i) % journals_.size();
    if (!journals_[at].find(key, run, found)) continue;
    if (at != last_found_) journals_[last_found_].release();
    last_found_ = at;
    return true;
  }
  return false;
}

void JournalSet::set_error_db(double error_db) {
  if (!writes_) return;
  const std::lock_guard lock(mutex_);
  journals_.front().set_error_db(error_db);
}

Result<void> JournalSet::append(const TracedRuns& traced) {
  if (!writes_ || traced.runs().empty()) return {};
  std::vector<std::uint64_t> keys;
  for (const TracedRun& run : traced.runs()) keys.push_back(key_of(run.run));
  const std::lock_guard lock(mutex_);
  return journals_.front().append(keys, traced);
}

}  // namespace clamor
