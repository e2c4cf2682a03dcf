// bake_command.cpp: clamor bake: bakes a level file to a bake file or to a shard of one.
#include <charconv>
#include <ostream>

#include "bake/journal/shard_note.h"
#include "tools/commands/bake_arguments.h"
#include "tools/commands/bake_run.h"
#include "tools/commands/commands.h"
#include "tools/commands/watched_bake.h"
#include "tools/program/arguments.h"

namespace clamor {

namespace {

// Parses "2/8", the second of eight shards.
std::optional<Shard> parse_shard(const std::string& text) {
  Shard shard;
  const char* const end = text.data() + text.size();
  const auto [slash, wrong] = std::from_chars(text.data(), end, shard.index);
  if (wrong != std::errc() || slash == end || *slash != '/') return std::nullopt;
  const auto [last, wrong_too] = std::from_chars(slash + 1, end, shard.count);
  if (wrong_too != std::errc() || last != end || shard.index == 0 || shard.index > shard.count ||
      shard.count > kMaxShards)
    return std::nullopt;
  --shard.index;
  return shard;
}

std::optional<std::uint64_t> hash_from(const std::string& text) {
  std::uint64_t hash = 0;
  const char* const end = text.data() + text.size();
  const auto [rest, wrong] = std::from_chars(text.data(), end, hash, 16);
  if (wrong != std::errc() || rest != end || text.size() != 16) return std::nullopt;
  return hash;
}

// The words of options of the run.
struct RunWords {
  std::optional<std::string> shard, progress, until, level_hash, expected_time, measured;
  bool no_journal = false, watches = false;

  void add_options(Arguments& parser, BakeRunOptions& run);
};

void RunWords::add_options(Arguments& parser, BakeRunOptions& run) {
  parser.option(
      "--until", until,
      "an error or a duration, as in 0.5dB or 15min: bake until the energy decay is known "
      "that well, or for that long; sets --photons and --sources");
  parser.option(
      "--measured", measured,
      "reverberation times of the real room, a JSON file with t30_s or t20_s: fit the "
      "materials' absorption to them, and write a sidecar, OUTPUT.acoustics.json, instead "
      "of a bake file");
  parser.option("--shard", shard,
                "I/N: trace only part I of N into OUTPUT; 'clamor merge' joins the parts");
  parser.option(
      "--level-hash", level_hash,
      "refuse a level whose content hash, with that of its files, is not this one; 'clamor "
      "farm' writes it");
  parser.option("--expected-time", expected_time,
                "time that the shard is expected to take, as in 90s, for schedulers that read the "
                "line; changes nothing");
  parser.option("--threads", run.bake.bake.threads,
                "maximum number of threads, 0: all cores; does not change the output");
  parser.within("--threads", run.bake.bake.threads, 0, 1024);
  parser.bytes("--memory", run.bake.bake.memory_bytes,
               "limit, as in 500MB or 2GB: what exceeds it is kept in temporary files beside "
               "OUTPUT, and a bake that needs more even then is refused before it starts; does "
               "not change the output");
  parser.flag("--no-journal", no_journal,
              "do not write the traced paths to OUTPUT.journal, from which an interrupted bake "
              "continues");
  parser.flag(
      "--keep-journal", run.bake.keeps_journal,
      "keep OUTPUT.journal, several times as large as OUTPUT, when the bake is complete: the "
      "next bake traces only more photons, or emitters that moved");
  parser.option("--progress", progress,
                "json: print progress as JSON, one object a line, for build systems; journal: keep "
                "it in the shard, for 'clamor farm status'");
  parser.words("--progress", {"json", "journal"});
  parser.flag("--watch", watches,
              "bake again whenever the level, a file that it uses or its sidecar changes, until "
              "Ctrl-C: first a quick bake, then better ones, each complete in OUTPUT");
  parser.flag("--quiet", run.quiet, "print only warnings and errors");
  parser.flag("--strict", run.bake.strict,
              "treat warnings as errors: exit code 1, and nothing is written");
}

// Turns the words into options. The Error is bad usage.
Result<void> interpret(const RunWords& words, const BakeRequest& request, BakeRunOptions& run) {
  if (const auto complaint = request.complaint()) return Error(*complaint);
  if (words.shard) {
    run.bake.shard = parse_shard(*words.shard);
    if (!run.bake.shard)
      return Error("--shard " + in_quotes(*words.shard) +
                   " is not a part like 1/4, the first of four");
  }
  if (words.until) {
    run.bake.goal = BakeGoal::from(*words.until);
    if (!run.bake.goal)
      return Error("--until " + in_quotes(*words.until) +
                   " is neither an error like 0.5dB nor a time like 90s, 15min or 2h");
    if (request.photons || request.sources || words.shard)
      return Error(
          "--until sets the number of photons and sources, so it cannot be combined with "
          "--photons, --sources or --shard");
  }
  if (words.level_hash) {
    run.bake.level_hash = hash_from(*words.level_hash);
    if (!run.bake.level_hash)
      return Error("--level-hash " + in_quotes(*words.level_hash) +
                   " is not 16 hexadecimal digits");
  }
  if (words.watches &&
      (words.shard || words.until || words.progress || words.level_hash || run.bake.strict))
    return Error(
        "--watch bakes what is there, in stages; it cannot be combined with --shard, --until, "
        "--progress, --level-hash or --strict");
  if (words.measured) {
    if (words.shard || words.until || words.progress || words.level_hash || words.watches)
      return Error(
          "--measured fits absorptions and bakes nothing; it cannot be combined with --shard, "
          "--until, --progress, --level-hash or --watch");
    run.measured = *words.measured;
    run.bake.journal = "";
  }
  run.json_progress = words.progress == "json";
  run.bake.bake.tells_progress = words.progress == "journal";
  if (words.progress && !run.json_progress && !run.bake.bake.tells_progress)
    return Error("--progress " + in_quotes(*words.progress) + " is neither json nor journal");
  if (run.bake.bake.tells_progress && !words.shard)
    return Error("--progress journal is for shards");
  if (words.no_journal && run.bake.keeps_journal)
    return Error("--keep-journal keeps what --no-journal does not write; give one of them");
  if (words.no_journal) run.bake.journal = "";
  return {};
}

}  // namespace

int run_bake(std::span<const std::string> arguments, std::ostream& out, std::ostream& err) {
  BakeRequest request;
  BakeRunOptions run;
  run.command = "bake";
  RunWords words;
  Arguments parser(
      "bake",
      "Traces sound through a glTF level and writes its emitters and their reflections "
      "(secondary sources) to one bake file.",
      "clamor bake hall.glb -o hall.clamor --emitter "
      "\"name=violin,signal=violin.flac,at=1,1.2,-3,facing=0,0,1,directivity=2\"");
  parser.positional("level", request.level_path, "the level, a .gltf or .glb file");
  parser.option("-o,--output", run.bake.output, "the bake file to write, as in hall.clamor");
  parser.required("-o");
  add_bake_options(parser, request);
  words.add_options(parser, run);
  parser.then([&] { return interpret(words, request, run); });
  if (const auto code = parser.parse(arguments, out, err)) return *code;
  return words.watches ? run_watched_bake(request, run, err) : run_bake_request(request, run, err);
}

}  // namespace clamor
