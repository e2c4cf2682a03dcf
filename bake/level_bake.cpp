#include "bake/level_bake.h"

#include <filesystem>
#include <utility>

#include <fmt/format.h>

#include "bake/bake_cache.h"
#include "bake/journal/shard_note.h"
#include "bake/report/level_report.h"
#include "bake/trace/scene.h"
#include "common/counted_texts.h"
#include "common/utf8_path.h"
#include "formats/bake_file/bake_writer.h"
#include "formats/gltf/level_import.h"

namespace clamor {

namespace {

std::uint64_t number_or(const std::optional<std::string>& typed, std::uint64_t otherwise) {
  return typed ? *whole_number(*typed) : otherwise;
}

}  // namespace

LevelBake::LevelBake(const BakeRequest& request, const LevelBakeOptions& options,
                     BakeObserver& observer)
    : request_(request), options_(options), observer_(observer) {}

LevelBake::~LevelBake() = default;

Result<void> LevelBake::find_output() {
  if (options_.output.empty()) {
    journal_ = options_.journal.value_or("");
    return {};
  }
  auto target = OutputTarget::find(options_.output);
  if (!target.ok()) return target.error();
  target_ = std::move(*target);
  if (options_.shard && target_->is_stream())
    return Error(options_.output +
                 ": a shard is written while it is traced; name a file, not a device or pipe");
  journal_ = options_.shard         ? options_.output
             : options_.journal     ? *options_.journal
             : target_->is_stream() ? ""
                                    : options_.output + ".journal";
  return {};
}

// Checks that neither the output nor its journal would replace an input.
Result<void> LevelBake::spare_inputs() const {
  InputFiles inputs = imported_->files;
  for (const std::string& shard : options_.bake.shards) inputs.add(shard);
  for (const std::string& output : {options_.output, journal_}) {
    if (output.empty()) continue;
    if (const auto safe = OutputTarget::find(output, inputs); !safe.ok()) return safe.error();
  }
  return {};
}

Result<void> LevelBake::read() {
  if (auto found = find_output(); !found.ok()) return found;
  observer_.on_stage("reading the level");
  import_ = request_.import;
  if (request_.seed) import_.seed = *whole_number(*request_.seed);
  auto imported = import_level(request_.level_path, import_);
  if (!imported.ok()) return imported.error();
  file_hash_ = imported->input_hash;
  imported_ = std::make_unique<ImportedLevel>(std::move(*imported));
  if (options_.level_hash && *options_.level_hash != *file_hash_)
    return Error(fmt::format(
        "{}: has the content hash {:016x} with its files, but {:016x} is asked for; restore the "
        "level, or plan the bake of the new one",
        request_.level_path, *file_hash_, *options_.level_hash));
  if (auto same = check_level_hash(options_.bake.shards, *file_hash_, request_.level_path);
      !same.ok())
    return same;
  return spare_inputs();
}

Result<void> LevelBake::take(ImportedLevel level, std::optional<std::uint64_t> file_hash) {
  if (auto found = find_output(); !found.ok()) return found;
  import_ = request_.import;
  if (request_.seed) import_.seed = *whole_number(*request_.seed);
  file_hash_ = file_hash;
  imported_ = std::make_unique<ImportedLevel>(std::move(level));
  return spare_inputs();
}

void LevelBake::warn(const std::string& text) {
  ++warnings_;
  observer_.on_warning(text);
}

void LevelBake::warn_and_keep(const std::vector<std::string>& texts) {
  for (std::string& text : with_counts(texts)) {
    warn(text);
    kept_warnings_.push_back(std::move(text));
  }
}

// An Error if warnings are errors and there were any.
Result<void> LevelBake::check_strict() {
  if (!options_.strict || warnings_ == 0) return {};
  failed_strict_ = true;
  return Error((warnings_ == 1 ? "1 warning" : std::to_string(warnings_) + " warnings") +
               " above, and --strict treats warnings as errors; nothing was written");
}

Result<void> LevelBake::prepare() {
  observer_.on_import(imported_->level.name, imported_->report);
  warn_and_keep(imported_->report.warnings);
  const LevelReport prepared = prepare_level(
      imported_->level,
      {request_.simplify_m, options_.bake.stop,
       options_.cache != nullptr ? &options_.cache->geometry : nullptr, imported_->rounding_m,
       [this](const char* stage) { observer_.on_stage(stage); }});
  if (options_.bake.is_stopped()) return Error("stopped before the level was prepared");
  observer_.on_prepared(prepared);
  warn_and_keep(report_warnings(prepared));
  findings_ = findings_in(prepared);
  if (auto placed = place_probes(); !placed.ok()) return placed;
  return check_strict();
}

Result<void> LevelBake::place_probes() {
  const Level& level = imported_->level;
  observer_.on_stage("placing probes");
  auto placed = clamor::place_probes(Scene(level.mesh, Scene::Build::kQuick), level,
                                     *probe_options(request_.probes));
  if (!placed.ok()) return placed.error();
  probes_ = std::move(*placed);
  observer_.on_probes(probes_);
  warn_and_keep(probes_.warnings);
  return {};
}

BakeOptions LevelBake::bake_options() const {
  const ImportedSettings& wanted = imported_->settings;
  BakeOptions options = options_.bake;
  options.settings.seed = number_or(request_.seed, wanted.seed.value_or(1));
  options.settings.photons = number_or(request_.photons, wanted.photons.value_or(0));
  options.settings.sources = number_or(request_.sources, 0);
  if (const auto order = whole_number(request_.early_order))
    options.settings.early_order = static_cast<int>(*order);
  options.settings.roulette_exponent = request_.roulette_exponent;
  options.settings.longest_path_s = request_.longest_s.value_or(0);
  options.settings.air = imported_->level.air;
  options.probes_m = probes_.positions_m;
  options.probe_sources =
      static_cast<std::uint32_t>(number_or(request_.probe_sources, kProbeSources));
  if (request_.instances == "on") options.groups = imported_->groups;
  if (target_) options.spill = target_->temporary_prefix();
  options.journal = journal_;
  if (options_.shard)
    options.note = {
        shard_program(), imported_->input_hash, {options_.shard->index}, options_.shard->count,
        false,           options_.request};
  if (options_.reports_progress)
    options.on_progress = [this](const BakeProgress& done) { observer_.on_progress(done); };
  return options;
}

Result<BakeReport> LevelBake::trace_shard() {
  observer_.on_stage("planning the photons and early reflections");
  auto report = bake_shard(imported_->level, bake_options(), *options_.shard);
  if (!report.ok()) return report.error().in(request_.level_path);
  return report;
}

Result<AbsorptionFit> LevelBake::fit(const MeasuredDecay& measured) {
  observer_.on_stage("tracing photons, whose paths are fitted");
  auto fit = fit_absorption(imported_->level, bake_options(), measured);
  if (!fit.ok()) return fit.error().in(request_.level_path);
  const std::string sidecar = request_.import.sidecar.value_or(
      path_of(request_.level_path).replace_extension(".acoustics.json").string());
  if (auto written = write_fitted_sidecar(options_.output, sidecar, imported_->level, *fit);
      !written.ok())
    return written.error();
  return fit;
}

Result<BakeCost> LevelBake::cost() {
  observer_.on_stage("tracing a few photons, to see what they cost");
  BakeOptions options = bake_options();
  if (options_.goal) {
    options.settings.photons = 0;
    options.settings.sources = BakeRounds::sources_of_first(imported_->level);
  }
  auto cost = bake_cost(imported_->level, options);
  if (!cost.ok()) return cost.error().in(request_.level_path);
  return cost;
}

std::uint64_t LevelBake::level_hash() const { return imported_->input_hash; }

std::vector<std::string> LevelBake::input_paths() const { return imported_->files.paths(); }

// Checks that the level is still what was baked.
Result<void> LevelBake::check_unchanged() const {
  if (!file_hash_) return {};
  const auto again = import_level(request_.level_path, import_);
  if (again.ok() && again->input_hash == *file_hash_) return {};
  return Error(
      request_.level_path +
      ": the level, or a file it uses, changed during the bake, so nothing was written; run the "
      "same command again");
}

// The options that reproduce the bake: with a goal, the numbers of photons and sources that it
// reached.
std::vector<std::string> LevelBake::words() const {
  if (!options_.goal) return request_.words();
  BakeRequest request = request_;
  request.photons = std::to_string(contents_.settings.photons);
  request.sources = std::to_string(contents_.settings.sources);
  return request.words();
}

Result<void> LevelBake::write_contents() {
  observer_.on_writing();
  observer_.on_stage("writing the file");
  SignalCache* const signals = options_.cache != nullptr ? &options_.cache->signals : nullptr;
  if (!options_.output.empty())
    return write_bake(options_.output, contents_, options_.bake.threads, options_.bake.stop,
                      signals);
  auto bytes = bake_bytes(imported_->level.name, contents_, options_.bake.threads,
                          options_.bake.stop, signals);
  if (!bytes.ok()) return bytes.error();
  bytes_ = std::move(*bytes);
  return {};
}

std::uint64_t LevelBake::file_bytes() const {
  if (options_.output.empty()) return bytes_.size();
  std::error_code gone;
  const auto bytes = std::filesystem::file_size(path_of(options_.output), gone);
  return gone ? 0 : bytes;
}

Result<void> LevelBake::write() {
  const Level& level = imported_->level;
  observer_.on_stage("planning the photons and early reflections");
  auto contents = options_.goal
                      ? bake_until(level, bake_options(), *options_.goal, &report_, &missed_goal_)
                      : bake(level, bake_options(), &report_);
  if (!contents.ok())
    return contents.error().in(request_.level_path.empty() ? level.name : request_.level_path);
  contents_ = std::move(*contents);
  if (!options_.tool.empty()) contents_.provenance.tool = options_.tool;
  contents_.provenance.level = level.name;
  contents_.provenance.input_hash = imported_->input_hash;
  contents_.provenance.inputs = imported_->inputs;
  contents_.provenance.arguments = words();
  observer_.on_stage("reading the level again, to see whether it changed");
  if (auto unchanged = check_unchanged(); !unchanged.ok()) return unchanged;
  warn_and_keep(contents_.statistics.warnings);
  contents_.statistics.warnings = kept_warnings_;
  contents_.statistics.findings = findings_;
  if (!report_.journal_warning.empty()) warn(report_.journal_warning);
  if (!missed_goal_.empty()) warn("--until was not reached: " + missed_goal_);
  if (auto strict = check_strict(); !strict.ok()) return strict;
  if (auto written = write_contents(); !written.ok()) return written;
  remove_journal();
  return {};
}

// A journal that the caller names is kept, as one is that he asks for.
void LevelBake::remove_journal() {
  if (journal_.empty() || options_.journal || options_.keeps_journal) return;
  std::error_code stays;
  removed_journal_ = std::filesystem::remove(path_of(journal_), stays);
}

}  // namespace clamor
