// merge_command.cpp: clamor merge: joins the shards of a bake.
#include <ostream>

#include <fmt/format.h>
#include <fmt/ostream.h>

#include "bake/journal/trace_journal.h"
#include "tools/commands/bake_arguments.h"
#include "tools/commands/bake_run.h"
#include "tools/commands/commands.h"
#include "tools/program/arguments.h"

namespace clamor {

int run_merge(std::span<const std::string> arguments, std::ostream& out, std::ostream& err) {
  BakeRunOptions run;
  run.command = "merge";
  run.bake.journal = "";
  std::optional<std::string> level;

  Arguments parser(
      "merge",
      "Joins the shards of a bake, in any order, into the same bytes as a bake on one machine. The "
      "level is read again from the path that the shards were made from, or from --level.",
      "clamor merge hall.1.shard hall.2.shard -o hall.clamor");
  parser.positional("shards", run.bake.shards, "files written by 'clamor bake --shard I/N'");
  parser.option("-o,--output", run.bake.output, "the bake file to write, as in hall.clamor");
  parser.required("-o");
  parser.option("--level", level, "path of the level on this machine");
  parser.option("--threads", run.bake.threads,
                "maximum number of threads, 0: all cores; does not change the output");
  parser.flag("--quiet", run.quiet, "print only warnings and errors");
  parser.flag("--strict", run.bake.strict,
              "treat warnings as errors: exit code 1, and nothing is written");
  if (const auto code = parser.parse(arguments, out, err)) return *code;
  if (run.bake.threads < 0 || run.bake.threads > 1024)
    return parser.bad_usage(err, "--threads must lie between 0 and 1024");

  std::string note;
  for (const std::string& shard : run.bake.shards) {
    const auto opened = TraceJournal::open_to_read(shard, 0);
    if (!opened.ok()) {
      fmt::print(err, "clamor merge: {}\n", opened.error().message);
      return kBadInput;
    }
    if (opened->note().empty() || (!note.empty() && opened->note() != note)) {
      fmt::print(err, "clamor merge: {}: {}\n", shard,
                 opened->note().empty()
                     ? "is not a shard, or its bake was stopped before it began; make it with "
                       "'clamor bake "
                       "--shard I/N'"
                     : "was made with other options than " + run.bake.shards[0] +
                           "; the shards of one bake may differ only in --shard and -o");
      return kBadInput;
    }
    note = opened->note();
  }
  auto request = request_from_note(note);
  if (!request) {
    fmt::print(
        err, "clamor merge: {}: the options that it was made with cannot be read; trace it again\n",
        run.bake.shards[0]);
    return kBadInput;
  }
  if (level) request->level_path = *level;
  return run_bake_request(*request, run, err);
}

}  // namespace clamor
