#include "tools/commands/bake_run.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <ostream>
#include <string_view>

#include <fmt/format.h>
#include <fmt/ostream.h>

#include "bake/report/level_report.h"
#include "formats/files/output_target.h"
#include "formats/gltf/import_report.h"
#include "tools/commands/bake_arguments.h"
#include "tools/commands/bake_summary.h"
#include "tools/commands/commands.h"
#include "tools/commands/level_inspection.h"
#include "tools/program/interrupt.h"
#include "tools/program/output_ending.h"
#include "tools/program/progress.h"
#include "tools/program/stage_notice.h"
#include "tools/program/terminal_output.h"
#include "tools/program/text_format.h"
#include "tools/report/level_findings.h"

namespace clamor {

namespace {

std::string probe_line(const ProbePlacement& probes) {
  const std::size_t automatic = probes.positions_m.size() - probes.hand_placed;
  std::string line;
  if (automatic > 0)
    line = fmt::format("{} for {:.0f} m2 of floor, {:.2g} m apart in the open", automatic,
                       probes.floor_m2, probes.spacing_m);
  if (probes.hand_placed > 0)
    line += fmt::format("{}{} placed by hand", line.empty() ? "" : ", and ", probes.hand_placed);
  return line;
}

// Prints what the bake tells: text, JSON lines, or only warnings.
class BakePrinter final : public BakeObserver {
 public:
  BakePrinter(const std::string& level_path, const BakeRunOptions& run, std::ostream& err)
      : level_path_(level_path),
        json_(run.json_progress),
        text_(!run.quiet && !run.json_progress),
        err_(err),
        notice_(err) {}

  void on_stage(const std::string& stage) override {
    if (text_) notice_.begin(stage);
  }

  void on_import(const std::string& level, const ImportReport& report) override {
    if (!text_) return;
    const auto held = notice_.hold();
    print_import(level, report, err_);
  }

  void on_prepared(const LevelReport& report) override {
    const auto held = notice_.hold();
    if (json_) fmt::print(err_, "{}\n", level_json(report));
    if (!text_) return;
    for (const auto& line : report_lines(report)) {
      fmt::print(err_, "  level    {}\n", printable(line));
      print_way_to(line);
    }
  }

  void on_probes(const ProbePlacement& probes) override {
    if (!text_ || probes.positions_m.empty()) return;
    const auto held = notice_.hold();
    fmt::print(err_, "  probes   {}\n", probe_line(probes));
  }

  void on_warning(const std::string& text) override {
    const auto held = notice_.hold();
    if (json_) {
      fmt::print(err_, "{}\n", warning_json(text));
      return;
    }
    print_listed_warning(err_, text);
    print_way_to(text);
  }

  void on_progress(const BakeProgress& done) override {
    const double share = share_of(done.photons_done, done.photons_total);
    if (done.stage != stage_ || share < share_) begin_stage(done.stage);
    share_ = share;
    const double seconds = progress_->seconds();
    if (json_)
      return progress_->update_json(progress_json(done, seconds, progress_->seconds_left(share)));
    if (stage_ == "sorting") return notice_.begin("sorting the sources");
    notice_.end();
    progress_->update(
        share,
        {done.error_db > 0 ? fmt::format("known to {:.2f} dB", done.error_db) : "",
         with_si_prefix(static_cast<double>(done.photons_done)) + "photons",
         with_si_prefix(static_cast<double>(done.bounces) / std::max(seconds, 1e-3)) + "bounces/s",
         fmt::format("{:.1f} % escaped", 100 * share_of(done.escaped, done.photons_done))});
  }

  // Begins the line of the progress, which ends with this object.
  void begin_progress() { progress_.emplace(err_, "  tracing"); }
  double seconds() const { return progress_->seconds(); }
  bool is_text() const { return text_; }
  // Nothing is printed from here on.
  void end_stage() { notice_.end(); }

 private:
  // With a goal, the bake is traced again and again, with more photons each time.
  void begin_stage(std::string_view stage) {
    if (stage == "tracing") ++round_;
    stage_ = stage;
    progress_->begin(round_ > 1 ? fmt::format("  {}, round {}", stage_, round_) : "  " + stage_);
  }

  // The command that shows the place of which a sentence speaks.
  void print_way_to(const std::string& sentence) {
    if (const auto place_m = place_in(sentence); place_m && text_)
      fmt::print(err_, "           {}\n", printable(view_command(level_path_, *place_m)));
  }

  const std::string& level_path_;
  const bool json_, text_;
  std::ostream& err_;
  std::optional<Progress> progress_;
  std::string stage_;
  double share_ = 0;
  int round_ = 0;
  StageNotice notice_;
};

std::string stop_message(const LevelBake& bake) {
  if (bake.journal().empty()) return "stopped; nothing was written";
  return "stopped; the traced paths are kept in " + bake.journal() +
         ", and the same command continues from there";
}

Result<void> trace_shard(LevelBake& bake, const BakeRunOptions& run, BakePrinter& printer,
                         std::ostream& err) {
  const auto report = bake.trace_shard();
  printer.end_stage();
  if (!report.ok()) return report.error();
  if (!run.quiet)
    fmt::print(err, "  wrote    {}: shard {} of {}, {} photons in {:.1f} MB, {:.1f} s\n",
               run.bake.output, run.bake.shard->index + 1, run.bake.shard->count, report->photons,
               static_cast<double>(report->journal_bytes) / 1e6, printer.seconds());
  return {};
}

Result<void> write_file(LevelBake& bake, const BakeRunOptions& run, BakePrinter& printer,
                        std::ostream& err) {
  const auto written = bake.write();
  printer.end_stage();
  if (!written.ok()) return written;
  if (run.json_progress)
    fmt::print(err, "{}\n", outcome_json(bake, printer.seconds()));
  else if (!run.quiet)
    print_bake_summary(bake.contents(), bake.report(), run.bake.output, bake.journal(),
                       bake.removed_journal(), printer.seconds(), err);
  return {};
}

// The times that absorptions are to be fitted to, which the output must not replace.
Result<MeasuredDecay> read_measured(const BakeRunOptions& run) {
  InputFiles inputs;
  inputs.add(run.measured);
  const auto safe = OutputTarget::find(run.bake.output, inputs);
  return safe.ok() ? MeasuredDecay::read(run.measured) : safe.error();
}

Result<void> fit_to_measured(LevelBake& bake, const MeasuredDecay& measured,
                             const BakeRunOptions& run, BakePrinter& printer, std::ostream& err) {
  const auto fit = bake.fit(measured);
  printer.end_stage();
  if (!fit.ok()) return fit.error();
  if (!run.quiet) print_fit(*fit, measured, run.bake.output, err);
  return {};
}

Result<void> run_stages(LevelBake& bake, const BakeRunOptions& run, LevelBakeOptions& options,
                        BakePrinter& printer, std::ostream& err) {
  if (run.bake.output.empty()) return Error("-o is empty; name a file to write, as in hall.clamor");
  const bool fits = !run.measured.empty();
  Result<MeasuredDecay> measured = MeasuredDecay();
  if (fits) measured = read_measured(run);
  if (!measured.ok()) return measured.error();
  if (auto read = bake.read(); !read.ok()) return read;
  if (auto right = check_ending(run.bake.output,
                                fits             ? ".acoustics.json"
                                : run.bake.shard ? ".shard"
                                                 : ".clamor",
                                fits             ? "sidecars"
                                : run.bake.shard ? "shards"
                                                 : "bake files");
      !right.ok())
    return right;
  if (auto prepared = bake.prepare(); !prepared.ok()) return prepared;
  const Interrupt interrupt;
  const StopDeadline deadline("clamor " + run.command + ": " + stop_message(bake));
  options.bake.stop = &Interrupt::requested();
  printer.begin_progress();
  auto done = fits             ? fit_to_measured(bake, *measured, run, printer, err)
              : run.bake.shard ? trace_shard(bake, run, printer, err)
                               : write_file(bake, run, printer, err);
  if (!done.ok() && Interrupt::requested()) return Error(stop_message(bake));
  return done;
}

}  // namespace

int run_bake_request(const BakeRequest& request, const BakeRunOptions& run, std::ostream& err) {
  LevelBakeOptions options = run.bake;
  options.reports_progress = run.json_progress || !run.quiet;
  if (options.shard) options.request = note_of(request);
  Result<void> done;
  {
    BakePrinter printer(request.level_path, run, err);
    LevelBake bake(request, options, printer);
    done = run_stages(bake, run, options, printer, err);
    if (done.ok() && bake.warnings() > 0 && printer.is_text()) {
      err << "  done     with ";
      print_as_warning(err, counted(bake.warnings(), "warning") + " above");
      err << '\n';
    }
  }
  if (done.ok()) return kSuccess;
  print_error(err, run.command, done.error().message);
  return kBadInput;
}

}  // namespace clamor
