// watched_bake.h: clamor bake --watch: bakes a level again whenever one of its files changes.
#pragma once

#include <atomic>
#include <iosfwd>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "bake/bake_request.h"
#include "common/platform/system_file.h"
#include "formats/files/file_access.h"
#include "tools/commands/bake_run.h"

namespace clamor {

// Notices changes of files, also of those that do not exist yet or any more.
//
// Threads: one.
class FilesWatcher {
 public:
  // Also watches these files from their present versions on. Known files keep the version seen.
  void add(std::span<const std::string> paths);

  // Checks the file system. Returns true once some files have changed and two checks in a row have
  // seen the same versions, since programs write files piece by piece. Later changes are
  // relative to these versions.
  bool check();

 private:
  using Versions = std::map<std::string, std::optional<FileVersion>>;
  Versions now() const;

  Versions known_, seen_;
};

// Bakes in stages (ProgressiveBake's), each of which replaces the output, then waits for a change;
// a change during a bake begins it anew. A level that cannot be read, as while it is being saved,
// is reported, and the last output stays. Returns an exit code after an interrupt.
int run_watched_bake(const BakeRequest& request, const BakeRunOptions& run, std::ostream& err);

}  // namespace clamor
