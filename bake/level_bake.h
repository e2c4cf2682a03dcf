// level_bake.h: a bake from the level to the bake file, as the commands and the C interface run it.
//
//   LevelBake bake(request, options, observer);
//   bake.read() -> bake.prepare() -> bake.write() or bake.trace_shard() or bake.cost()
//
// Threads: one.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "bake/absorption_fit.h"
#include "bake/bake.h"
#include "bake/bake_observer.h"
#include "bake/bake_options.h"
#include "bake/bake_request.h"
#include "bake/bake_until.h"
#include "bake/probes/probe_placement.h"
#include "formats/bake_file/bake_contents.h"
#include "formats/files/output_target.h"
#include "formats/gltf/import_options.h"

namespace clamor {

struct BakeCache;  // bake/bake_cache.h
struct ImportedLevel;

// Options of the run. Except for the goal, none of them changes the output.
struct LevelBakeOptions {
  std::string output;                       // file; "": the bytes stay in memory
  BakeOptions bake;                         // without what follows from the level and the request
  std::optional<std::string> journal;       // "": none; unset: beside the output
  bool keeps_journal = false;               // the one beside the output, when the bake is complete
  std::string request;                      // for the note of a shard
  std::optional<std::uint64_t> level_hash;  // refuse a level with another content hash
  bool strict = false;                      // a warning is an error, and nothing is written
  bool reports_progress = true;             // calls BakeObserver::on_progress()
  std::optional<BakeGoal> goal;             // sets the number of photons and sources
  std::optional<Shard> shard;               // then `output` is that shard
  BakeCache* cache = nullptr;               // of earlier bakes, which spares work; null: none
  std::string tool;                         // for the provenance; "": this program
};

class LevelBake {
 public:
  // The arguments must outlive the object.
  LevelBake(const BakeRequest& request, const LevelBakeOptions& options, BakeObserver& observer);
  ~LevelBake();
  LevelBake(const LevelBake&) = delete;
  LevelBake& operator=(const LevelBake&) = delete;

  // Checks that the output can be written, and reads the level: better before the tracing than
  // after.
  Result<void> read();

  // Instead of reading it, takes a level that the caller has made. `file_hash` is the input_hash of
  // the file at request.level_path that it was made from, if there is one.
  Result<void> take(ImportedLevel level, std::optional<std::uint64_t> file_hash);

  // Prepares the mesh and reports on the level.
  Result<void> prepare();

  Result<BakeReport> trace_shard();

  // Fits the absorptions to measured times, and writes them into the output, a sidecar.
  Result<AbsorptionFit> fit(const MeasuredDecay& measured);

  // What the bake would take, and its first round where there is a goal.
  Result<BakeCost> cost();
  std::uint64_t level_hash() const;              // after read()
  std::vector<std::string> input_paths() const;  // of the files that read() has read

  // Bakes the level and writes the file. A level that has changed on disk meanwhile is an Error.
  Result<void> write();

  const std::string& journal() const { return journal_; }    // path; "" for none
  bool removed_journal() const { return removed_journal_; }  // after write()
  std::size_t warnings() const { return warnings_; }
  bool failed_strict() const { return failed_strict_; }

  // After write():
  const BakeContents& contents() const { return contents_; }
  const BakeReport& report() const { return report_; }
  const std::string& missed_goal() const { return missed_goal_; }  // why, or ""
  std::uint64_t file_bytes() const;
  std::vector<std::byte>& bytes() { return bytes_; }  // of the file, without an output

 private:
  Result<void> find_output();
  Result<void> spare_inputs() const;
  Result<void> check_unchanged() const;
  Result<void> check_strict();
  Result<void> write_contents();
  void remove_journal();
  BakeOptions bake_options() const;
  Result<void> place_probes();
  std::vector<std::string> words() const;
  void warn(const std::string& text);
  void warn_and_keep(const std::vector<std::string>& texts);

  const BakeRequest& request_;
  const LevelBakeOptions& options_;
  BakeObserver& observer_;
  ImportOptions import_;
  std::unique_ptr<ImportedLevel> imported_;
  std::optional<std::uint64_t> file_hash_;
  std::optional<OutputTarget> target_;
  std::string journal_;
  bool removed_journal_ = false;
  std::size_t warnings_ = 0;
  std::vector<std::string> kept_warnings_;  // those about the result, for the file
  LevelFindings findings_;
  bool failed_strict_ = false;
  ProbePlacement probes_;
  BakeContents contents_;
  BakeReport report_;
  std::string missed_goal_;
  std::vector<std::byte> bytes_;
};

}  // namespace clamor
