#include "tools/commands/bake_run.h"

#include <algorithm>
#include <cmath>
#include <ostream>

#include <fmt/format.h>
#include <fmt/ostream.h>

#include "bake/report/level_report.h"
#include "formats/bake_file/bake_writer.h"
#include "tools/commands/bake_summary.h"
#include "tools/commands/commands.h"
#include "tools/commands/progress_json.h"
#include "tools/program/interrupt.h"
#include "tools/program/progress.h"
#include "tools/program/stop_deadline.h"
#include "tools/program/text_format.h"

namespace clamor {

namespace {

void print_report(const ImportReport& report, const Level& level, std::ostream& err) {
  fmt::print(err, "{}\n", printable(level.name));
  for (const auto& line : report.found) fmt::print(err, "  found    {}\n", printable(line));
  for (const auto& material : report.materials)
    fmt::print(err, "  material {:<24} {:<18} {:>8.1f} m2  ({})\n", printable(material.material),
               material.preset.empty() ? "own values" : printable(material.preset),
               material.area_m2, printable(material.how));
  for (const auto& line : report.ignored) fmt::print(err, "  ignored  {}\n", printable(line));
}

// Collects all warnings of a bake: prints them even with --quiet, keeps those about the result for
// the file, and counts them for --strict.
class Warnings {
 public:
  Warnings(bool json, std::ostream& err) : json_(json), err_(err) {}

  void tell(const std::string& text) {
    ++count_;
    if (json_)
      fmt::print(err_, "{}\n", warning_json(text));
    else
      fmt::print(err_, "  warning  {}\n", printable(text));
  }
  void tell_and_keep(const std::vector<std::string>& texts) {
    for (const std::string& text : texts) tell(text);
    kept_.insert(kept_.end(), texts.begin(), texts.end());
  }

  std::size_t count() const { return count_; }
  const std::vector<std::string>& kept() const { return kept_; }

 private:
  bool json_;
  std::ostream& err_;
  std::size_t count_ = 0;
  std::vector<std::string> kept_;
};

double share_of(std::uint64_t part, std::uint64_t whole_of_it) {
  return whole_of_it > 0 ? static_cast<double>(part) / static_cast<double>(whole_of_it) : 0;
}

// Checks that the level is still what was baked.
std::optional<Error> changed(const std::string& path, const ImportOptions& import,
                             std::uint64_t input_hash) {
  const auto again = import_level(path, import);
  if (again.ok() && again->input_hash == input_hash) return std::nullopt;
  return Error(
      path +
      ": the level, or a file it uses, changed during the bake, so nothing was written; run the "
      "same command again");
}

// Checks that neither the output nor its journal would replace an input.
Result<void> spare_inputs(const BakeRunOptions& run, const std::string& journal,
                          InputFiles inputs) {
  for (const std::string& shard : run.shards) inputs.add(shard);
  for (const std::string& output : {run.output, journal}) {
    if (output.empty()) continue;
    if (const auto safe = OutputTarget::find(output, inputs); !safe.ok()) return safe.error();
  }
  return {};
}

// The options that reproduce the bake: with --until, the numbers of photons and sources that it
// reached.
std::vector<std::string> words_of(BakeRequest request, const BakeRunOptions& run,
                                  const BakeSettings& settings) {
  if (run.goal) {
    request.photons = std::to_string(settings.photons);
    request.sources = std::to_string(settings.sources);
  }
  return request.words();
}

// One bake, from the level file to the bake file or shard.
class BakeRun {
 public:
  BakeRun(const BakeRequest& request, const BakeRunOptions& run, std::ostream& err)
      : request_(request),
        run_(run),
        err_(err),
        prints_text_(!run.quiet && !run.json_progress),
        warnings_(run.json_progress, err) {}

  Result<void> run();

 private:
  Result<void> read_level();
  Result<void> prepare();
  BakeOptions options() const;
  Result<void> trace_shard(const Level& level, const BakeOptions& options,
                           const Progress& progress);
  Result<void> bake_file(const Level& level, const BakeOptions& options, const Progress& progress);
  void show_progress(BakeOptions& options, Progress& progress) const;

  // An Error if --strict and there were warnings.
  Result<void> check_strict() const;

  Error failure(const Error& error) const {
    return Interrupt::requested() ? Error(stop_message()) : error.in(request_.level_path);
  }
  std::string stop_message() const;

  const BakeRequest& request_;
  const BakeRunOptions& run_;
  std::ostream& err_;
  const bool prints_text_;
  Warnings warnings_;
  ImportOptions import_;
  std::optional<ImportedLevel> imported_;
  std::optional<OutputTarget> target_;
  std::string journal_;  // path; "" for none
};

std::string BakeRun::stop_message() const {
  if (journal_.empty()) return "stopped; nothing was written";
  return "stopped; the traced paths are kept in " + journal_ +
         ", and the same command continues from there";
}

Result<void> BakeRun::check_strict() const {
  if (!run_.strict || warnings_.count() == 0) return {};
  return Error(fmt::format(
      "{} above, and --strict treats warnings as errors; nothing was written",
      warnings_.count() == 1 ? "1 warning" : fmt::format("{} warnings", warnings_.count())));
}

// Reads the level, and checks first that the output can be written: better before the tracing than
// after.
Result<void> BakeRun::read_level() {
  if (run_.output.empty()) return Error("-o is empty; name a file to write, as in hall.clamor");
  auto target = OutputTarget::find(run_.output);
  if (!target.ok()) return target.error();
  target_ = std::move(*target);
  if (run_.shard && target_->is_stream())
    return Error(run_.output +
                 ": a shard is written while it is traced; name a file, not a device or pipe");
  import_ = request_.import;
  if (request_.seed) import_.seed = *whole_number(*request_.seed);
  auto imported = import_level(request_.level_path, import_);
  if (!imported.ok()) return imported.error();
  imported_ = std::move(*imported);
  journal_ = run_.shard                              ? run_.output
             : run_.journal && !target_->is_stream() ? run_.output + ".journal"
                                                     : "";
  return spare_inputs(run_, journal_, imported_->files);
}

// Prepares the mesh and reports on the level.
Result<void> BakeRun::prepare() {
  if (prints_text_) print_report(imported_->report, imported_->level, err_);
  warnings_.tell_and_keep(imported_->report.warnings);
  const LevelReport prepared = prepare_level(imported_->level, {request_.simplify_m});
  if (run_.json_progress) fmt::print(err_, "{}\n", level_json(prepared));
  if (prints_text_)
    for (const auto& line : report_lines(prepared))
      fmt::print(err_, "  level    {}\n", printable(line));
  warnings_.tell_and_keep(report_warnings(prepared));
  return check_strict();
}

BakeOptions BakeRun::options() const {
  const ImportedSettings& wanted = imported_->settings;
  BakeOptions options;
  options.settings.seed = request_.seed ? *whole_number(*request_.seed) : wanted.seed.value_or(1);
  options.settings.photons =
      request_.photons ? *whole_number(*request_.photons) : wanted.photons.value_or(0);
  options.settings.sources = request_.sources ? *whole_number(*request_.sources) : 0;
  options.settings.roulette_exponent = request_.kappa;
  options.settings.longest_path_s = request_.longest_s;
  options.settings.air = imported_->level.air;
  if (request_.instances == "on") options.groups = imported_->groups;
  options.threads = run_.threads;
  options.memory_bytes = run_.memory_bytes;
  options.spill = target_->temporary_prefix();
  options.shards = run_.shards;
  options.journal = journal_;
  options.stop = &Interrupt::requested();
  if (run_.shard) options.note = request_.note();
  return options;
}

void BakeRun::show_progress(BakeOptions& options, Progress& progress) const {
  if (run_.json_progress)
    options.on_progress = [&progress](const BakeProgress& done) {
      progress.update_json(progress_json(done, progress.seconds()));
    };
  else if (!run_.quiet)
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
}

Result<void> BakeRun::run() {
  if (auto read = read_level(); !read.ok()) return read;
  if (auto prepared = prepare(); !prepared.ok()) return prepared;
  const Interrupt interrupt;
  const StopDeadline deadline("clamor " + run_.command + ": " + stop_message());
  BakeOptions bake_options = options();
  Progress progress(err_, "  tracing");
  show_progress(bake_options, progress);
  return run_.shard ? trace_shard(imported_->level, bake_options, progress)
                    : bake_file(imported_->level, bake_options, progress);
}

Result<void> BakeRun::trace_shard(const Level& level, const BakeOptions& options,
                                  const Progress& progress) {
  const auto report = bake_shard(level, options, *run_.shard);
  if (!report.ok()) return failure(report.error());
  if (!run_.quiet)
    fmt::print(err_, "  wrote    {}: shard {} of {}, {} photons in {:.1f} MB, {:.1f} s\n",
               run_.output, run_.shard->index + 1, run_.shard->count, report->photons,
               static_cast<double>(report->journal_bytes) / 1e6, progress.seconds());
  return {};
}

Result<void> BakeRun::bake_file(const Level& level, const BakeOptions& options,
                                const Progress& progress) {
  BakeReport report;
  std::string why_not;
  auto contents = run_.goal ? bake_until(level, options, *run_.goal, &report, &why_not)
                            : bake(level, options, &report);
  if (!contents.ok()) return failure(contents.error());
  contents->provenance.level = level.name;
  contents->provenance.input_hash = imported_->input_hash;
  contents->provenance.inputs = imported_->inputs;
  contents->provenance.arguments = words_of(request_, run_, contents->settings);
  if (const auto now = changed(request_.level_path, import_, imported_->input_hash)) return *now;
  warnings_.tell_and_keep(contents->statistics.warnings);
  contents->statistics.warnings = warnings_.kept();
  if (!report.journal_warning.empty()) warnings_.tell(report.journal_warning);
  if (!why_not.empty()) warnings_.tell("--until was not reached: " + why_not);
  if (auto strict = check_strict(); !strict.ok()) return strict;
  if (auto written = write_bake(run_.output, *contents, run_.threads); !written.ok())
    return written;
  if (run_.json_progress)
    fmt::print(err_, "{}\n",
               outcome_json({.sources = contents->source_count() + report.instanced_sources,
                             .photons = report.photons,
                             .photons_reused = report.photons_reused,
                             .error_db = contents->statistics.decay.error_db,
                             .seconds = progress.seconds(),
                             .goal_reached = why_not.empty(),
                             .warnings = warnings_.count()}));
  if (prints_text_)
    print_bake_summary(*contents, report, run_.output, options.journal, progress.seconds(), err_);
  return {};
}

}  // namespace

int run_bake_request(const BakeRequest& request, const BakeRunOptions& run, std::ostream& err) {
  BakeRun bake(request, run, err);
  const auto done = bake.run();
  if (done.ok()) return kSuccess;
  fmt::print(err, "clamor {}: {}\n", run.command, done.error().message);
  return kBadInput;
}

}  // namespace clamor
