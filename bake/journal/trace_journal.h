// trace_journal.h: keeps what is traced, so that no photon is traced twice.
//
// One file beside the bake's output. Runs of photons are appended as they are traced, each under a
// key that hashes all they depend on (run_key.h): scene, materials, settings, the emitter itself. A
// bake that was stopped or killed finds its runs there, and so does one some of whose emitters were
// moved: those of all other emitters. A change of the mesh or of a material changes every key,
// since a run of 1024 paths of some forty reflections meets nearly every surface. Since equal keys
// mean equal results, using the journal never changes a byte of the output.
//
// How it is kept: journal_file.h. A record that a crash cut short, and all after it, are cut off on
// opening; one that is damaged counts as absent.
//
// Threads: one at a time. Memory: 24 bytes per run in the file, and one record.
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <string>

#include "bake/trace/photon_tracer.h"
#include "common/result.h"

namespace clamor {

class TraceJournal {
 public:
  // Makes the file or opens what is there; refuses a file that is no journal, or that another
  // process has open. `materials`: how many the level has; what names others is damaged.
  static Result<TraceJournal> open(const std::string& path, std::size_t materials);
  TraceJournal(TraceJournal&&) noexcept;
  TraceJournal& operator=(TraceJournal&&) noexcept;
  ~TraceJournal();

  // A journal that is only asked: nothing is made, cut off or locked.
  static Result<TraceJournal> open_to_read(const std::string& path, std::size_t materials);

  // Words kept in the file for whoever reads it; at most a megabyte. The last ones count.
  Result<void> set_note(const std::string& note);
  const std::string& note() const;

  // True if the run is in the journal; then it is appended to `result`.
  bool find(std::uint64_t key, const PhotonRun& run, TracedRuns& result);

  // Adds runs under their keys. On failure (a full disk) the file is cut back to what it was.
  Result<void> append(std::span<const std::uint64_t> keys, const TracedRuns& traced);

  // What was added is on the disk: done at every second anyway, and when the journal is closed, but
  // only this says whether it worked.
  Result<void> sync();

  // Leaves only what was found or appended since opening, if that is less than half of the file.
  Result<void> compact();

  std::size_t runs() const;  // that can be found
  std::uint64_t bytes() const;
  std::uint64_t damaged() const;  // records found to be

 private:
  struct State;
  explicit TraceJournal(std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

}  // namespace clamor
