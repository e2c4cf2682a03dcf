// clamor_bake_run.cpp: the functions of clamor_bake.h that bake.
#include <algorithm>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "bake/application_level.h"
#include "bake/bake_plan.h"
#include "bake/bake_watch.h"
#include "bake/clamor_bake.h"
#include "bake/clamor_bake_calls.h"
#include "bake/level_bake.h"
#include "common/c_structures.h"
#include "common/version.h"
#include "formats/bake_file/image_source.h"

namespace {

using clamor::ApplicationLevel;
using clamor::BakePhase;
using clamor::copy_from_caller;
using clamor::copy_to_caller;
using clamor::Error;
using clamor::fail;
using clamor::guarded;
using clamor::is_structure_size;
using clamor::refuse;
using clamor::Result;
using clamor::size_refusal;
using clamor::text_of;

constexpr std::uint32_t kMaxThreads = 1024;

// The problem with the options' values, or null.
const char* complaint(const clamor_bake_options& options) {
  const auto lies = [](double value, double highest) { return value >= 0 && value <= highest; };
  if (options.threads > kMaxThreads) return "threads must lie between 0 and 1024";
  if (options.photons > 4'000'000'000u) return "photons must be at most 4000000000";
  if (options.sources > clamor::kMaxSources) return "sources must be at most 200000000";
  if (options.seed >= 1'000'000'000'000'000'000u) return "the seed must be below 1e18";
  if (!lies(options.simplify_m, 10)) return "simplify_m must lie between 0 and 10 m";
  if (!lies(options.roulette_exponent, 1)) return "roulette_exponent must lie between 0 and 1";
  if (!lies(options.longest_path_s, 60)) return "longest_path_s must lie between 0 and 60 s";
  if (!lies(options.goal_error_db, 1e6) || !lies(options.goal_s, 1e9))
    return "goals must be positive numbers";
  const bool has_goal = options.goal_error_db > 0 || options.goal_s > 0;
  if (has_goal && (options.photons > 0 || options.sources > 0))
    return "a goal sets the photons and sources, so leave them 0";
  if (options.goal_error_db > 0 && options.goal_s > 0) return "give one goal, not both";
  if (options.has_early_order != 0 && options.early_order > unsigned{clamor::kMaxImageOrder})
    return "early_order must lie between 0 and 3";
  if (options.probe_spacing_m != -1 && !lies(options.probe_spacing_m, 1e6))
    return "probe_spacing_m must lie between 0 and 1e6 m, or be -1";
  return nullptr;
}

clamor::BakeRequest request_of(const ApplicationLevel& level, const clamor_bake_options& options) {
  clamor::BakeRequest request;
  request.level_path = level.path();
  request.import = level.options();
  if (options.seed > 0) request.seed = std::to_string(options.seed);
  if (options.photons > 0) request.photons = std::to_string(options.photons);
  if (options.sources > 0) request.sources = std::to_string(options.sources);
  if (options.no_instances != 0) request.instances = "off";
  if (options.has_early_order != 0) request.early_order = std::to_string(options.early_order);
  if (options.probe_spacing_m != 0)
    request.probes = options.probe_spacing_m < 0 ? "auto" : fmt::to_string(options.probe_spacing_m);
  request.simplify_m = options.simplify_m;
  if (options.roulette_exponent > 0) request.roulette_exponent = options.roulette_exponent;
  if (options.longest_path_s > 0) request.longest_s = options.longest_path_s;
  return request;
}

clamor::LevelBakeOptions run_options(const ApplicationLevel& level,
                                     const clamor_bake_options& options) {
  clamor::LevelBakeOptions run;
  run.bake.threads = static_cast<int>(options.threads);
  run.bake.memory_bytes = options.memory_bytes;
  run.journal = text_of(options.journal);
  run.strict = options.strict != 0;
  if (options.goal_error_db > 0 || options.goal_s > 0)
    run.goal = clamor::BakeGoal{options.goal_error_db, options.goal_s};
  if (!level.is_file_alone()) run.tool = std::string(clamor::kLibraryTool) + clamor::kVersion;
  return run;
}

double share_of(std::uint64_t part, std::uint64_t whole) {
  return whole > 0 ? static_cast<double>(part) / static_cast<double>(whole) : 0;
}

clamor_bake_progress progress_of(BakePhase phase, const clamor::BakeProgress& done, double seconds,
                                 double tracing_s) {
  clamor_bake_progress progress{};
  progress.bytes = sizeof(progress);
  progress.phase = static_cast<std::uint32_t>(phase);
  progress.fraction =
      phase > BakePhase::kTracing ? 1 : share_of(done.photons_done, done.photons_total);
  progress.photons = done.photons_done;
  progress.photons_total = done.photons_total;
  progress.photons_reused = done.photons_reused;
  progress.bounces = done.bounces;
  progress.escaped = done.escaped;
  progress.bounces_per_s = static_cast<double>(done.bounces) / std::max(tracing_s, 1e-3);
  progress.error_db = done.error_db;
  progress.seconds = seconds;
  return progress;
}

clamor::BakeWatch::Callbacks callbacks_of(const clamor_bake_options& options) {
  clamor::BakeWatch::Callbacks callbacks;
  if (options.progress != nullptr)
    callbacks.progress = [call = options.progress, user = options.user](
                             BakePhase phase, const clamor::BakeProgress& done, double seconds,
                             double tracing_s) {
      const clamor_bake_progress progress = progress_of(phase, done, seconds, tracing_s);
      return call(user, &progress) == 0;
    };
  if (options.message != nullptr)
    callbacks.message = [call = options.message,
                         user = options.user](const clamor::BakeMessage& message) {
      call(user, message.is_warning ? CLAMOR_BAKE_WARNING : CLAMOR_BAKE_NOTE, message.text.c_str());
    };
  return callbacks;
}

clamor_bake_report report_of(const clamor::LevelBake& bake, std::uint64_t file_bytes,
                             double seconds) {
  const clamor::BakeContents& contents = bake.contents();
  const clamor::DecaySummary& decay = contents.statistics.decay;
  clamor_bake_report report{};
  report.warnings = static_cast<std::uint32_t>(bake.warnings());
  report.sources = contents.source_count() + bake.report().instanced_sources;
  report.photons = bake.report().photons;
  report.photons_reused = bake.report().photons_reused;
  report.file_bytes = file_bytes;
  report.missed_goal = !bake.missed_goal().empty();
  report.error_db = decay.error_db;
  std::copy(decay.t30_s.begin(), decay.t30_s.end(), report.t30_s);
  std::copy(decay.t30_error_s.begin(), decay.t30_error_s.end(), report.t30_error_s);
  report.seconds = seconds;
  return report;
}

// The code and the sentence of a bake that failed.
clamor_bake_result failure(const clamor::LevelBake& bake, const clamor::BakeWatch& watch,
                           const Error& why, clamor_bake_error* error) {
  if (watch.stop()) return fail(error, CLAMOR_BAKE_ERROR_CANCELLED);
  if (bake.failed_strict())
    return fail(error, CLAMOR_BAKE_ERROR_WARNINGS,
                "strict is set, and the first of " + std::to_string(bake.warnings()) +
                    " warnings is: " + watch.first_warning());
  return fail(error,
              bake.report().exceeds_memory ? CLAMOR_BAKE_ERROR_MEMORY : CLAMOR_BAKE_ERROR_FILE,
              why.message);
}

Result<void> bake_stages(clamor::LevelBake& bake, const ApplicationLevel& level,
                         const clamor::BakeRequest& request) {
  std::optional<std::uint64_t> seed, file_hash;
  if (request.seed) seed = clamor::whole_number(*request.seed);
  auto whole = level.whole(seed, file_hash);
  if (!whole.ok()) return whole.error();
  if (auto taken = bake.take(std::move(*whole), file_hash); !taken.ok()) return taken;
  if (auto prepared = bake.prepare(); !prepared.ok()) return prepared;
  return bake.write();
}

// Bakes into the file, or into memory if `path` is empty.
clamor_bake_result run_bake(const clamor_bake_level* level, const clamor_bake_options* options,
                            const std::string& path, clamor_bake_report* report,
                            std::vector<std::byte>* bytes, clamor_bake_error* error) {
  clamor_bake_options chosen;
  if (level == nullptr || !copy_from_caller(options, chosen))
    return refuse(error, size_refusal(options));
  if (report != nullptr && !is_structure_size(report->bytes))
    return refuse(error, size_refusal(report));
  if (const char* const wrong = complaint(chosen)) return refuse(error, wrong);
  const ApplicationLevel& made = clamor::level_of(*level);
  if (made.emitters() == 0 && (made.probes() == 0 || made.triangles() == 0))
    return fail(
        error, CLAMOR_BAKE_ERROR_LEVEL,
        "the level has no emitter, and no surfaces with probes, so there is nothing to bake; "
        "add an emitter");
  clamor::LevelBakeOptions run = run_options(made, chosen);
  run.output = path;
  clamor::BakeWatch watch(callbacks_of(chosen));
  run.bake.stop = &watch.stop();
  const clamor::BakeRequest request = request_of(made, chosen);
  clamor::LevelBake bake(request, run, watch);
  Result<void> done;
  watch.run([&] { done = bake_stages(bake, made, request); });
  if (!done.ok()) return failure(bake, watch, done.error(), error);
  if (bytes != nullptr) *bytes = std::move(bake.bytes());
  if (report != nullptr)
    copy_to_caller(report_of(bake, bake.file_bytes(), watch.seconds()), report);
  return CLAMOR_BAKE_OK;
}

}  // namespace

extern "C" {

clamor_bake_result clamor_bake_to_file(const clamor_bake_level* level,
                                       const clamor_bake_options* options, const char* path,
                                       clamor_bake_report* report, clamor_bake_error* error) {
  return guarded(error, [&] {
    if (path == nullptr || *path == 0) return refuse(error, "name a file to write");
    // A pipe without a reader would raise SIGPIPE.
    const auto target = clamor::OutputTarget::find(path);
    if (!target.ok()) return fail(error, CLAMOR_BAKE_ERROR_FILE, target.error().message);
    if (target->is_stream())
      return fail(error, CLAMOR_BAKE_ERROR_FILE,
                  std::string(path) + ": is a device or a pipe; name a file, or bake into memory");
    return run_bake(level, options, path, report, nullptr, error);
  });
}

clamor_bake_result clamor_bake_to_memory(const clamor_bake_level* level,
                                         const clamor_bake_options* options, void** bytes,
                                         uint64_t* byte_count, clamor_bake_report* report,
                                         clamor_bake_error* error) {
  return guarded(error, [&] {
    if (bytes == nullptr || byte_count == nullptr) return fail(error, CLAMOR_BAKE_ERROR_ARGUMENT);
    *bytes = nullptr;
    *byte_count = 0;
    std::vector<std::byte> baked;
    const clamor_bake_result result = run_bake(level, options, "", report, &baked, error);
    if (result != CLAMOR_BAKE_OK) return result;
    *bytes = std::malloc(baked.size());
    if (*bytes == nullptr) return fail(error, CLAMOR_BAKE_ERROR_MEMORY);
    std::memcpy(*bytes, baked.data(), baked.size());
    *byte_count = baked.size();
    return result;
  });
}

void clamor_bake_free(void* bytes) { std::free(bytes); }

}  // extern "C"
