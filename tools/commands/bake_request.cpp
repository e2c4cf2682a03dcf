#include "tools/commands/bake_request.h"

#include <algorithm>
#include <filesystem>
#include <sstream>

#include <fmt/format.h>

#include "bake/report/level_report.h"
#include "formats/bake_file/bake_writer.h"
#include "formats/level/emitter_spec.h"

namespace clamor {

std::optional<std::uint64_t> whole_number(const std::string& text) {
  if (text.empty() || text.size() > 18 ||
      !std::all_of(text.begin(), text.end(), [](char c) { return c >= '0' && c <= '9'; }))
    return std::nullopt;
  return std::stoull(text);
}

void BakeRequest::add_options(Arguments& parser) {
  parser.option(
      "--emitter", import.emitters,
      "add an emitter: name=NAME,signal=FILE|noise|impulse,at=X,Y,Z[,facing=X,Y,Z][,gain=0dB]"
      "[,directivity=P][,delay=S][,loop=yes]; may be repeated");
  parser.option("--acoustics", import.sidecar,
                "sidecar file to use instead of LEVEL.acoustics.json");
  parser.option("--material", import.material,
                "preset for materials without acoustic data [plaster]");
  parser.flag("--hidden", import.hidden_meshes, "include meshes that the level marks as hidden");
  parser.option(
      "--photons", photons,
      "photons to trace; more of them reduce noise, not the number of sources [unset: enough for "
      "--sources]");
  parser.option(
      "--sources", sources,
      "maximum number of secondary sources to keep [unset: 200 000 per room with emitters]");
  parser.option("--seed", seed,
                "seed of all random numbers; the same seed gives the same bytes [1]");
  parser.option(
      "--simplify", simplify_m,
      "remove triangles, moving surfaces by at most this many metres, as in 0.05 [0: off]");
  parser.option("--copies", copies,
                "on or off: store groups of emitters that the level repeats once, as instances");
  parser.option(
      "--kappa", kappa,
      "exponent of Russian roulette, 0 to 1: a path survives with probability (power after / "
      "power before)^kappa");
  parser.option("--longest", longest_s, "longest path to trace, in seconds");
}

std::optional<std::string> BakeRequest::complaint() const {
  for (const std::string& emitter : import.emitters)
    if (const auto spec = parse_emitter(emitter); !spec.ok()) return spec.error().message;
  if (photons && (!whole_number(*photons) || *whole_number(*photons) == 0 ||
                  *whole_number(*photons) > 4'000'000'000u))
    return "--photons " + in_quotes(*photons) + " is not a whole number from 1 to 4000000000";
  if (sources && (!whole_number(*sources) || *whole_number(*sources) == 0 ||
                  *whole_number(*sources) > 10'000'000u))
    return "--sources " + in_quotes(*sources) + " is not a whole number from 1 to 10000000";
  if (seed && !whole_number(*seed)) return "--seed " + in_quotes(*seed) + " is not a whole number";
  if (!(simplify_m >= 0 && simplify_m <= 10)) return "--simplify must lie between 0 and 10 metres";
  if (copies != "on" && copies != "off")
    return "--copies " + in_quotes(copies) + " is neither on nor off";
  if (!(kappa >= 0 && kappa <= 1)) return "--kappa must lie between 0 and 1";
  if (!(longest_s > 0 && longest_s <= 60)) return "--longest must lie between 0 and 60 seconds";
  return std::nullopt;
}

std::vector<std::string> BakeRequest::words() const {
  std::vector<std::string> words;
  const auto add = [&words](const std::string& option, const std::optional<std::string>& value) {
    if (value) words.insert(words.end(), {option, *value});
  };
  for (const std::string& emitter : import.emitters) add("--emitter", emitter);
  add("--acoustics", import.sidecar);
  add("--material", import.material);
  if (import.hidden_meshes) words.emplace_back("--hidden");
  add("--photons", photons);
  add("--sources", sources);
  add("--seed", seed);
  if (simplify_m > 0) add("--simplify", fmt::format("{}", simplify_m));
  if (copies != "on") add("--copies", copies);
  if (kappa != BakeSettings{}.roulette_exponent) add("--kappa", fmt::format("{}", kappa));
  if (longest_s != BakeSettings{}.longest_path_s) add("--longest", fmt::format("{}", longest_s));
  return words;
}

std::string BakeRequest::note() const {
  std::string note = std::filesystem::absolute(level_path).string();
  for (const std::string& word : words()) note += '\0' + word;
  return note;
}

std::optional<BakeRequest> BakeRequest::from_note(const std::string& note) {
  std::vector<std::string> words{""};
  for (const char c : note)
    if (c == '\0')
      words.emplace_back();
    else
      words.back() += c;
  BakeRequest request;
  request.level_path = words[0];
  Arguments parser("merge", "", "");
  request.add_options(parser);
  std::ostringstream ignored;
  if (request.level_path.empty() ||
      parser.parse(std::span(words).subspan(1), ignored, ignored).has_value() ||
      request.complaint())
    return std::nullopt;
  return request;
}

int run_bake_request(const BakeRequest& request, const BakeRunOptions& manner, std::ostream& err) {
  const auto fail = [&](const Error& error) {
    fmt::print(err, "clamor {}: {}\n", manner.command, error.message);
    return kBadInput;
  };

  if (manner.output.empty())
    return fail(Error("-o is empty; name a file to write, as in hall.clamor"));
  // What cannot be written is better known before the tracing than after.
  const auto target = OutputTarget::find(manner.output);
  if (!target.ok()) return fail(target.error());
  if (manner.shard && target->is_stream())
    return fail(Error(manner.output + ": a shard is kept while it grows; name a file to write"));

  ImportOptions import = request.import;
  if (request.seed) import.seed = *whole(*request.seed);
  auto imported = import_level(request.level_path, import);
  if (!imported.ok()) return fail(imported.error());
  const Level& level = imported->level;
  const std::string journal = manner.shard                             ? manner.output
                              : manner.journal && !target->is_stream() ? manner.output + ".journal"
                                                                       : "";
  if (const auto safe = spare_inputs(manner, journal, imported->files); !safe.ok())
    return fail(safe.error());
  const bool in_words = !manner.quiet && !manner.json_progress;
  if (in_words) print_report(imported->report, level, err);
  Warnings warnings(manner.json_progress, err);
  warnings.tell_and_keep(imported->report.warnings);
  const LevelReport prepared = prepare_level(imported->level, {request.simplify_m});
  if (manner.json_progress) fmt::print(err, "{}\n", level_json(prepared));
  if (in_words)
    for (const auto& line : report_lines(prepared))
      fmt::print(err, "  level    {}\n", printable(line));
  warnings.tell_and_keep(report_warnings(prepared));
  const auto is_refused = [&] { return manner.strict && warnings.count() > 0; };
  const auto refuse = [&] {
    return fail(Error(fmt::format(
        "{} above, which --strict takes for {}; nothing was written",
        warnings.count() == 1 ? "1 warning" : fmt::format("{} warnings", warnings.count()),
        warnings.count() == 1 ? "an error" : "errors")));
  };
  if (is_refused()) return refuse();

  const ImportedSettings& wanted = imported->settings;
  BakeOptions options;
  options.settings.seed = request.seed ? *whole(*request.seed) : wanted.seed.value_or(1);
  options.settings.photons =
      request.photons ? *whole(*request.photons) : wanted.photons.value_or(0);
  options.settings.sources = request.sources ? *whole(*request.sources) : 0;
  options.settings.roulette_exponent = request.kappa;
  options.settings.longest_path_s = request.longest_s;
  options.settings.air = level.air;
  if (request.copies == "on") options.groups = imported->groups;
  options.threads = manner.threads;
  options.memory_bytes = manner.memory_bytes;
  options.spill = target->temporary_prefix();
  options.shards = manner.shards;
  options.journal = journal;
  if (manner.shard) options.note = request.note();

  const Interrupt interrupt;
  const Error stopped(options.journal.empty()
                          ? std::string("stopped; nothing was written")
                          : "stopped; what was traced is kept in " + options.journal +
                                ", and the same command goes on from there");
  const StopDeadline deadline("clamor " + manner.command + ": " + stopped.message);
  options.stop = &Interrupt::requested();
  Progress progress(err, "  tracing");
  if (manner.json_progress)
    options.on_progress = [&progress](const BakeProgress& done) {
      progress.update_json(progress_json(done, progress.seconds()));
    };
  else if (!manner.quiet)
    options.on_progress = [&progress](const BakeProgress& done) {
      progress.update(
          share_of(done.photons_done, done.photons_total),
          fmt::format("{}photons, {}bounces/s, {:.1f} % escaped{}",
                      with_si_prefix(static_cast<double>(done.photons_done)),
                      with_si_prefix(static_cast<double>(done.bounces) /
                                     std::max(progress.seconds(), 1e-3)),
                      100 * share_of(done.escaped, done.photons_done),
                      done.error_db > 0 ? fmt::format(", known to {:.2f} dB", done.error_db) : ""));
    };
  const auto ended = [&](const Error& error) {
    return fail(Interrupt::requested() ? stopped : error.in(request.level_path));
  };

  if (manner.shard) {
    const auto report = bake_shard(level, options, *manner.shard);
    if (!report.ok()) return ended(report.error());
    if (!manner.quiet)
      fmt::print(err, "  wrote    {}: shard {} of {}, {} photons in {:.1f} MB, {:.1f} s\n",
                 manner.output, manner.shard->index + 1, manner.shard->count, report->photons,
                 static_cast<double>(report->journal_bytes) / 1e6, progress.seconds());
    return kSuccess;
  }

  BakeReport report;
  std::string why_not;
  auto contents = manner.goal ? bake_until(level, options, *manner.goal, &report, &why_not)
                              : bake(level, options, &report);
  if (!contents.ok()) return ended(contents.error());
  contents->provenance.level = level.name;
  contents->provenance.input_hash = imported->input_hash;
  contents->provenance.inputs = imported->inputs;
  contents->provenance.arguments = words_of(request, manner, contents->settings);
  if (const auto now = changed(request.level_path, import, imported->input_hash)) return fail(*now);
  warnings.tell_and_keep(contents->statistics.warnings);
  contents->statistics.warnings = warnings.kept();
  if (!report.journal_warning.empty()) warnings.tell(report.journal_warning);
  if (!why_not.empty()) warnings.tell("--until was not reached: " + why_not);
  if (is_refused()) return refuse();
  if (const auto written = write_bake(manner.output, *contents, manner.threads); !written.ok())
    return fail(written.error());
  if (manner.json_progress)
    fmt::print(err, "{}\n",
               outcome_json({.sources = contents->source_count() + report.instanced_sources,
                             .photons = report.photons,
                             .photons_reused = report.photons_reused,
                             .error_db = contents->statistics.decay.error_db,
                             .seconds = progress.seconds(),
                             .goal_reached = why_not.empty(),
                             .warnings = warnings.count()}));
  if (in_words)
    print_bake_summary(*contents, report, manner.output, options.journal, progress.seconds(), err);
  return kSuccess;
}

}  // namespace clamor
