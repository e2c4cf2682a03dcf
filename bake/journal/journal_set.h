// journal_set.h: the journals of one bake: the one that it writes, and the shards that it reads.
#pragma once

#include <cstddef>
#include <vector>

#include "bake/journal/run_key.h"
#include "bake/journal/trace_journal.h"
#include "bake/trace/run_source.h"

namespace clamor {

struct OpenJournals {
  std::vector<TraceJournal> list;
  bool writes = false;   // the first of the list receives new runs
  bool has_all = false;  // the list has all runs; one that is missing is an Error
};

class JournalSet final : public RunSource {
 public:
  // The journals and what the keys refer to must outlive the object.
  JournalSet(OpenJournals& journals, const RunKeys& keys) : journals_(journals), keys_(keys) {}

  Result<bool> find(const PhotonRun& run, TracedRuns& found) override;
  Result<void> record(const TracedRuns& traced) override;
  void set_error_db(double error_db) override;

 private:
  OpenJournals& journals_;
  const RunKeys keys_;
  std::size_t last_found_ = 0;  // index of the journal that had the last run
};

}  // namespace clamor
