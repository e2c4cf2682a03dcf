// bake_command.cpp: clamor bake: from a level file to a bake file, or to a shard of one.
#include <charconv>
#include <ostream>

#include "tools/commands/bake_request.h"
#include "tools/commands/commands.h"
#include "tools/program/arguments.h"

namespace clamor {

namespace {

// "2/8" as the second of eight.
std::optional<Shard> parse_shard(const std::string& text) {
  Shard shard;
  const char* const end = text.data() + text.size();
  const auto [slash, wrong] = std::from_chars(text.data(), end, shard.index);
  if (wrong != std::errc() || slash == end || *slash != '/') return std::nullopt;
  const auto [last, wrong_too] = std::from_chars(slash + 1, end, shard.count);
  if (wrong_too != std::errc() || last != end || shard.index == 0 || shard.index > shard.count ||
      shard.count > 100'000)
    return std::nullopt;
  --shard.index;
  return shard;
}

}  // namespace

int run_bake(std::span<const std::string> arguments, std::ostream& out, std::ostream& err) {
  BakeRequest request;
  BakeRunOptions manner;
  manner.command = "bake";
  std::optional<std::string> shard;
  std::optional<std::string> progress, memory, until;
  bool no_journal = false;

  Arguments parser("bake",
                   "Traces sound through a glTF level and writes emitters and secondary sources "
                   "into one bake file.",
                   "clamor bake hall.glb -o hall.clamor --emitter "
                   "\"name=violin,signal=violin.flac,at=1,1.2,-3,facing=0,0,1,directivity=2\"");
  parser.positional("level", request.level_path, "the level, .gltf or .glb");
  parser.option("-o,--output", manner.output, "the bake file to write, as in hall.clamor");
  parser.required("-o");
  request.add_options(parser);
  parser.option("--until", until,
                "as in 0.5dB or 90s: bake until the energy decay is known so well, or for so long; "
                "decides --photons and --sources");
  parser.option("--shard", shard,
                "I/N: trace the I-th of N parts into OUTPUT; clamor merge puts them together");
  parser.option("--threads", manner.threads, "at most, 0: all cores; never changes a byte");
  parser.option("--memory", memory,
                "as in 500MB or 2GB: a bake that would take more says so before it starts");
  parser.flag("--no-journal", no_journal,
              "do not keep what was traced in OUTPUT.journal, for going on and for baking again");
  parser.option("--progress", progress,
                "json: one JSON object a line, for build systems, instead of words");
  parser.flag("--quiet", manner.quiet, "only warnings and errors");
  parser.flag("--strict", manner.strict,
              "warnings are errors: exit code 1, and nothing is written");
  if (const auto code = parser.parse(arguments, out, err)) return *code;
  if (const auto complaint = request.complaint()) return parser.bad_usage(err, *complaint);
  if (manner.threads < 0 || manner.threads > 1024)
    return parser.bad_usage(err, "--threads must lie between 0 and 1024");
  if (shard) {
    manner.shard = parse_shard(*shard);
    if (!manner.shard)
      return parser.bad_usage(
          err, "--shard " + in_quotes(*shard) + " is not a part like 1/4, the first of four");
  }
  if (until) {
    manner.goal = BakeGoal::from(*until);
    if (!manner.goal)
      return parser.bad_usage(err, "--until " + in_quotes(*until) +
                                       " is neither an error like 0.5dB nor a time like "
                                       "90s, 15min or 2h");
    if (request.photons || request.sources || shard)
      return parser.bad_usage(err,
                              "--until decides how many photons and sources there are, so it goes "
                              "with none of --photons, --sources and --shard");
  }
  if (progress && *progress != "json")
    return parser.bad_usage(err, "--progress " + in_quotes(*progress) + " is not json");
  if (memory) {
    const auto bytes = parse_bytes(*memory);
    if (!bytes.ok()) return parser.bad_usage(err, "--memory " + bytes.error().message);
    manner.memory_bytes = *bytes;
  }
  manner.json_progress = progress.has_value();
  manner.journal = !no_journal;
  return run_bake_request(request, manner, err);
}

}  // namespace clamor
