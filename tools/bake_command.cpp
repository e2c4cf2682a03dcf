// bake_command.cpp: clamor bake: from a level file to a bake file.
#include <algorithm>
#include <cmath>
#include <filesystem>
#include <ostream>

#include <fmt/format.h>
#include <fmt/ostream.h>

#include "bake/bake.h"
#include "formats/level_import.h"
#include "tools/arguments.h"
#include "tools/commands.h"
#include "tools/interrupt.h"
#include "tools/progress.h"

namespace clamor {

namespace {

void print_report(const ImportReport& report, const Level& level, std::ostream& err) {
  fmt::print(err, "{}\n", level.name);
  for (const auto& line : report.found) fmt::print(err, "  found    {}\n", line);
  for (const auto& material : report.materials)
    fmt::print(err, "  material {:<24} {:<18} {:>8.1f} m2  ({})\n", material.material,
               material.preset.empty() ? "own values" : material.preset, material.area_m2,
               material.how);
  for (const auto& line : report.ignored) fmt::print(err, "  ignored  {}\n", line);
  for (const auto& line : report.warnings) fmt::print(err, "  warning  {}\n", line);
}

// Where the emitters' power went.
void print_energy(const BakeStatistics& statistics, std::ostream& err) {
  double emitted = 0, unfinished = 0;
  for (std::size_t b = 0; b < kBandCount; ++b) {
    emitted += statistics.power_emitted[b];
    unfinished += statistics.power_unfinished[b];
  }
  const double photons = static_cast<double>(std::max<std::uint64_t>(1, statistics.photons_traced));
  fmt::print(err,
             "  traced   {} photons, {:.1f} bounces each, mean free path {:.2f} m; {:.1f} % of the "
             "photons escaped\n",
             statistics.photons_traced, static_cast<double>(statistics.bounces) / photons,
             statistics.mean_free_path_m,
             100 * static_cast<double>(statistics.photons_escaped) / photons);
  if (emitted > 0 && unfinished > 0.001 * emitted)
    fmt::print(err, "  warning  {:.2f} % of the power was still under way at the longest path\n",
               100 * unfinished / emitted);
  for (const auto& warning : statistics.warnings) fmt::print(err, "  warning  {}\n", warning);
}

}  // namespace

int run_bake(std::span<const std::string> arguments, std::ostream& out, std::ostream& err) {
  std::string level_path, output;
  ImportOptions import;
  BakeOptions options;
  std::optional<std::string> seed, photons, sources;
  bool quiet = false, no_journal = false;

  Arguments parser("bake",
                   "Traces sound through a glTF level and writes emitters and secondary sources "
                   "into one bake file.",
                   "clamor bake hall.glb -o hall.clamor --emitter "
                   "\"name=violin,signal=violin.flac,at=1,1.2,-3,facing=0,0,1,directivity=2\"");
  parser.positional("level", level_path, "the level, .gltf or .glb");
  parser.option("-o,--output", output, "the bake file to write, as in hall.clamor");
  parser.required("-o");
  parser.option("--emitter", import.emitters,
                "add an emitter: name=,signal=FILE|noise|impulse,at=X,Y,Z[,facing=X,Y,Z][,gain=0dB]"
                "[,directivity=P][,delay=S][,loop=yes]; may be given again");
  parser.option("--acoustics", import.sidecar, "instead of LEVEL.acoustics.json beside the level");
  parser.option("--material", import.material, "preset for materials that nothing tells [plaster]");
  parser.flag("--hidden", import.hidden_meshes, "also take meshes that the level hides");
  parser.option(
      "--photons", photons,
      "how many to trace: more make better sources, not more; unset: enough for the sources");
  parser.option("--sources", sources,
                "most reflections to keep; unset: 200 000 for each room with emitters");
  parser.option("--seed", seed, "of every random number; same seed, same bytes [1]");
  parser.option("--kappa", options.settings.roulette_kappa,
                "Russian roulette: survive with (power after / before)^kappa, 0 to 1");
  parser.option("--longest", options.settings.longest_path_s, "seconds to follow sound for");
  parser.option("--threads", options.threads, "0: all cores; never changes a byte");
  parser.flag("--no-journal", no_journal,
              "do not keep what was traced in OUTPUT.journal, for going on and for baking again");
  parser.flag("--quiet", quiet, "only warnings and errors");
  if (const auto code = parser.parse(arguments, out, err)) return *code;
  const auto whole = [](const std::string& text) -> std::optional<std::uint64_t> {
    if (text.empty() || text.size() > 18 ||
        !std::all_of(text.begin(), text.end(), [](char c) { return c >= '0' && c <= '9'; }))
      return std::nullopt;
    return std::stoull(text);
  };
  if (photons && (!whole(*photons) || *whole(*photons) == 0 || *whole(*photons) > 4'000'000'000u))
    return parser.bad_usage(
        err, "--photons " + in_quotes(*photons) + " is not a whole number from 1 to 4000000000");
  if (sources && (!whole(*sources) || *whole(*sources) == 0 || *whole(*sources) > 10'000'000u))
    return parser.bad_usage(
        err, "--sources " + in_quotes(*sources) + " is not a whole number from 1 to 10000000");
  if (seed && !whole(*seed))
    return parser.bad_usage(err, "--seed " + in_quotes(*seed) + " is not a whole number");
  if (!(options.settings.roulette_kappa >= 0 && options.settings.roulette_kappa <= 1))
    return parser.bad_usage(err, "--kappa must lie between 0 and 1");
  if (!(options.settings.longest_path_s > 0 && options.settings.longest_path_s <= 60))
    return parser.bad_usage(err, "--longest must lie between 0 and 60 seconds");
  if (options.threads < 0 || options.threads > 1024)
    return parser.bad_usage(err, "--threads must lie between 0 and 1024");

  const auto fail = [&err](const Error& error) {
    fmt::print(err, "clamor bake: {}\n", error.message);
    return kBadInput;
  };

  // A folder that cannot be written to is better known before the tracing than after.
  const auto folder = std::filesystem::absolute(output).parent_path();
  std::error_code problem;
  if (!std::filesystem::is_directory(folder, problem))
    return fail(Error(output + ": the folder " + in_quotes(folder.string()) +
                      " does not exist; make it first"));
  if (std::filesystem::is_directory(output, problem))
    return fail(Error(output + ": is a folder; name a file to write, as in hall.clamor"));

  if (seed) import.seed = *whole(*seed);
  auto imported = import_level(level_path, import);
  if (!imported.ok()) return fail(imported.error());
  const Level& level = imported->level;
  if (!quiet) print_report(imported->report, level, err);

  const ImportedSettings& wanted = imported->settings;
  options.settings.seed = seed ? *whole(*seed) : wanted.seed.value_or(1);
  options.settings.photons = photons ? *whole(*photons) : wanted.photons.value_or(0);
  options.settings.sources = sources ? *whole(*sources) : 0;
  options.settings.air = level.air;
  if (!no_journal) options.journal = output + ".journal";

  const Interrupt interrupt;
  options.stop = &Interrupt::requested();
  Progress progress(err, "  tracing");
  if (!quiet)
    options.on_progress = [&progress](const BakeProgress& done) {
      progress.update(
          static_cast<double>(done.photons_done) / static_cast<double>(done.photons_total),
          with_unit(static_cast<double>(done.bounces) / std::max(progress.seconds(), 1e-3)) +
              "bounces/s");
    };
  BakeReport report;
  auto contents = bake(level, options, &report);
  if (!contents.ok() && Interrupt::requested()) {
    if (no_journal)
      fmt::print(err, "clamor bake: stopped; nothing was written\n");
    else
      fmt::print(
          err,
          "clamor bake: stopped; what was traced is kept in {}, and the same command goes on "
          "from there\n",
          options.journal);
    return kBadInput;
  }
  if (!contents.ok()) return fail(contents.error().in(level_path));
  contents->provenance.level = level.name;
  contents->provenance.input_hash = imported->input_hash;
  if (const auto written = write_bake(output, *contents, options.threads); !written.ok())
    return fail(written.error());

  if (!quiet) {
    print_energy(contents->statistics, err);
    if (!report.journal_warning.empty()) fmt::print(err, "  warning  {}\n", report.journal_warning);
    if (report.photons_reused > 0)
      fmt::print(err, "  reused   {} of {} photons from {}\n", report.photons_reused,
                 contents->statistics.photons_traced, options.journal);
    const auto bytes = std::filesystem::file_size(output, problem);
    const auto written_sources = contents->octree.sources.size();
    fmt::print(err, "  wrote    {}: {} sources in {:.1f} MB, {:.1f} s\n", output, written_sources,
               static_cast<double>(bytes) / 1e6, progress.seconds());
    if (!no_journal)
      fmt::print(err, "  kept     {} ({:.1f} MB): baking again traces only what has changed\n",
                 options.journal, static_cast<double>(report.journal_bytes) / 1e6);
  }
  return kSuccess;
}

}  // namespace clamor
