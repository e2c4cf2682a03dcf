// trace_journal.h: stores traced photon runs, so that no photon is traced twice.
//
// The journal is one file beside the bake's output. Each traced run is appended under a key that
// hashes everything it depends on (run_key.h): mesh, materials, settings and its emitter. An
// interrupted bake finds its runs there; so does a bake after some emitters moved, for all other
// emitters. A change of the mesh or of a material invalidates every key, because a run of 1024
// paths with some forty reflections hits nearly every surface. Equal keys imply equal results, so
// the journal never changes a byte of the output.
//
// File format: journal_file.h. An incomplete record and everything after it are removed on opening;
// a damaged record counts as absent.
//
// The journal of a shard also has notes (shard_note.h): what it belongs to and, for a farm, how far
// it is.
//
// Threads: one at a time. Memory: 60 bytes per stored run, and one record.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "bake/journal/shard_note.h"
#include "bake/trace/photon_tracer.h"
#include "common/result.h"

namespace clamor {

class TraceJournal {
 public:
  // Creates or opens the file. Fails if the file is no journal or if another process has it open.
  // Runs that refer to a material index of `materials` or above, or to a portal index of `portals`
  // or above, count as damaged.
  static Result<TraceJournal> open(const std::string& path, std::size_t materials,
                                   std::size_t portals = 0);
  TraceJournal(TraceJournal&&) noexcept;
  TraceJournal& operator=(TraceJournal&&) noexcept;
  ~TraceJournal();

  // Opens a journal for find() only; the file is neither created, truncated nor locked.
  static Result<TraceJournal> open_to_read(const std::string& path, std::size_t materials,
                                           std::size_t portals = 0);

  // From now on stores the progress once a second, and before the next note.
  void tell_progress();

  // Stores a text of at most 1 MB for other readers of the file. The last note replaces earlier
  // ones.
  Result<void> set_note(const std::string& note);
  const std::string& note() const;

  // The error of the energy decay from the photons so far, for the progress.
  void set_error_db(double error_db);

  // Appends the run to `result` and returns true if the journal contains it.
  bool find(std::uint64_t key, const PhotonRun& run, TracedRuns& result);

  // Stores runs under their keys. On failure (a full disk) the file keeps its old contents.
  Result<void> append(std::span<const std::uint64_t> keys, const TracedRuns& traced);

  // Frees the memory of the last record that find() has read.
  void release();

  // Forces all appended runs to disk. The journal does so once per second and when closed, but only
  // this call reports errors.
  Result<void> sync();

  // Drops all runs not found or appended since opening, and damaged records, if that halves the
  // file or in any case. No other call may follow.
  Result<void> compact(bool in_any_case = false);

  std::size_t runs() const;  // number of stored runs
  std::uint64_t bytes() const;
  std::uint64_t damaged() const;    // damaged records encountered
  std::uint64_t cut_bytes() const;  // bytes of an incomplete record at the end

 private:
  struct State;
  explicit TraceJournal(std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

// What a journal says about itself, found without reading its runs.
struct JournalSummary {
  std::optional<ShardNote> note;
  std::optional<ShardProgress> progress;
  std::uint64_t bytes = 0;        // of complete records
  std::uint64_t cut_bytes = 0;    // of an incomplete record at the end
  bool is_being_written = false;  // by a process on this or another machine

  static Result<JournalSummary> of(const std::string& path);
};

// Fails if a record is damaged or incomplete. Memory: one record.
Result<void> check_records(const std::string& path);

// Writes the runs of several shards to one file, with a note of its own. Checks the checksums of
// all that it copies. Memory: one record.
Result<void> join_journals(const std::vector<std::string>& paths, const std::string& output,
                           const std::string& note);

}  // namespace clamor
