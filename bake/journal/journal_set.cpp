#include "bake/journal/journal_set.h"

#include <algorithm>

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
  for (const PhotonRun& run : runs) {
    const std::uint64_t key = key_of(run);
    const bool is_found =
        std::any_of(journals_.begin(), journals_.end(),
                    [&](TraceJournal& journal) { return journal.find(key, run, found); });
    if (!is_found) missing.push_back(run);
  }
}

Result<void> JournalSet::append(const TracedRuns& traced) {
  if (!writes_ || traced.runs().empty()) return {};
  std::vector<std::uint64_t> keys;
  for (const TracedRun& run : traced.runs()) keys.push_back(key_of(run.run));
  const std::lock_guard lock(mutex_);
  return journals_.front().append(keys, traced);
}

}  // namespace clamor
