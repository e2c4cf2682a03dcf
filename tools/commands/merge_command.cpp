// merge_command.cpp: clamor merge: from the shards of a bake to the bake file.
#include <ostream>

#include <fmt/format.h>
#include <fmt/ostream.h>

#include "bake/journal/trace_journal.h"
#include "tools/commands/bake_request.h"
#include "tools/commands/commands.h"
#include "tools/program/arguments.h"

namespace clamor {

int run_merge(std::span<const std::string> arguments, std::ostream& out, std::ostream& err) {
  BakeRunOptions manner;
  manner.command = "merge";
  manner.journal = false;
  std::optional<std::string> level;

  Arguments parser(
      "merge",
      "Puts the shards of a bake together, in any order, into the same bytes as a bake "
      "of the whole. The level is read again from where the shards were made, or from "
      "--level.",
      "clamor merge hall.1.shard hall.2.shard -o hall.clamor");
  parser.positional("shards", manner.shards, "made by clamor bake --shard I/N");
  parser.option("-o,--output", manner.output, "the bake file to write, as in hall.clamor");
  parser.required("-o");
  parser.option("--level", level, "where the level lies on this machine");
  parser.option("--threads", manner.threads, "at most, 0: all cores; never changes a byte");
  parser.flag("--quiet", manner.quiet, "only warnings and errors");
  parser.flag("--strict", manner.strict,
              "warnings are errors: exit code 1, and nothing is written");
  if (const auto code = parser.parse(arguments, out, err)) return *code;
  if (manner.threads < 0 || manner.threads > 1024)
    return parser.bad_usage(err, "--threads must lie between 0 and 1024");

  std::string note;
  for (const std::string& shard : manner.shards) {
    const auto opened = TraceJournal::open_to_read(shard, 0);
    if (!opened.ok()) {
      fmt::print(err, "clamor merge: {}\n", opened.error().message);
      return kBadInput;
    }
    if (opened->note().empty() || (!note.empty() && opened->note() != note)) {
      fmt::print(err, "clamor merge: {}: {}\n", shard,
                 opened->note().empty()
                     ? "is no shard, or was stopped before it began; make it with clamor bake "
                       "--shard I/N"
                     : "was made by another command than " + manner.shards[0] +
                           "; shards of one bake differ in --shard and -o only");
      return kBadInput;
    }
    note = opened->note();
  }
  auto request = BakeRequest::from_note(note);
  if (!request) {
    fmt::print(err, "clamor merge: {}: what it was made with cannot be read; trace it again\n",
               manner.shards[0]);
    return kBadInput;
  }
  if (level) request->level_path = *level;
  return run_bake_request(*request, manner, err);
}

}  // namespace clamor
