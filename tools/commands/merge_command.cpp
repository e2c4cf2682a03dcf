// merge_command.cpp: clamor merge: joins the shards of a bake.
#include <ostream>

#include <fmt/format.h>
#include <fmt/ostream.h>

#include "bake/journal/shard_note.h"
#include "bake/journal/trace_journal.h"
#include "formats/files/output_target.h"
#include "tools/commands/bake_arguments.h"
#include "tools/commands/bake_run.h"
#include "tools/commands/commands.h"
#include "tools/program/arguments.h"
#include "tools/program/output_ending.h"

namespace clamor {

namespace {

// Writes the shards to one file that is a shard itself.
Result<void> join_shards(const ShardNote& together, const BakeRunOptions& run, std::ostream& err) {
  const std::vector<std::string>& shards = run.bake.bake.shards;
  const std::string& output = run.bake.output;
  InputFiles inputs;
  for (const std::string& shard : shards) inputs.add(shard);
  if (const auto safe = OutputTarget::find(output, inputs); !safe.ok()) return safe.error();
  if (const auto right = check_ending(output, ".shard", "shards"); !right.ok()) return right;
  if (auto same = check_level_hash(shards, together.level_hash, shards.front()); !same.ok())
    return same;
  if (auto joined = join_journals(shards, output, together.text()); !joined.ok()) return joined;
  if (!run.quiet)
    fmt::print(err, "  wrote    {}: shards {} of {}\n", output, ranges_of(together.shards),
               together.count);
  return {};
}

}  // namespace

int run_merge(std::span<const std::string> arguments, std::ostream& out, std::ostream& err) {
  BakeRunOptions run;
  run.command = "merge";
  run.bake.journal = "";
  std::optional<std::string> level;
  bool to_shard = false;

  Arguments parser(
      "merge",
      "Joins the shards of a bake, in any order, into the same bytes as a bake on one machine. The "
      "level is read again from the path that the shards were made from, or from --level. A shard "
      "that is damaged, incomplete, of another bake, version or state of the level is named.",
      "clamor merge hall.1.shard hall.2.shard -o hall.clamor");
  parser.positional("shards", run.bake.bake.shards, "files written by 'clamor bake --shard I/N'");
  parser.option("-o,--output", run.bake.output, "the bake file to write, as in hall.clamor");
  parser.required("-o");
  parser.flag("--to-shard", to_shard,
              "join some of the shards into one larger shard, for merging thousands in two steps");
  parser.option("--level", level, "path of the level on this machine");
  parser.option("--threads", run.bake.bake.threads,
                "maximum number of threads, 0: all cores; does not change the output");
  parser.within("--threads", run.bake.bake.threads, 0, 1024);
  parser.bytes("--memory", run.bake.bake.memory_bytes,
               "limit, as in 500MB or 2GB: what exceeds it is kept in temporary files beside "
               "OUTPUT; does not change the output");
  parser.flag("--quiet", run.quiet, "print only warnings and errors");
  parser.flag("--strict", run.bake.strict,
              "treat warnings as errors: exit code 1, and nothing is written");
  if (const auto code = parser.parse(arguments, out, err)) return *code;
  const auto note = note_of_shards(run.bake.bake.shards);
  if (!note.ok()) return parser.end(err, note.error());
  if (to_shard) return parser.end(err, join_shards(*note, run, err));
  if (const auto all = check_all_there(*note); !all.ok()) return parser.end(err, all);
  auto request = request_from_note(note->request);
  if (!request)
    return parser.end(err,
                      Error(run.bake.bake.shards[0] +
                            ": the options that it was made with cannot be read; trace it again"));
  if (level) request->level_path = *level;
  return run_bake_request(*request, run, err);
}

}  // namespace clamor
