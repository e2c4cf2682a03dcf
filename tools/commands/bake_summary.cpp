#include "tools/commands/bake_summary.h"

#include <algorithm>
#include <filesystem>
#include <ostream>

#include <fmt/format.h>
#include <fmt/ostream.h>

#include "bake/bake_plan.h"
#include "bake/report/lost_power.h"
#include "common/utf8_path.h"
#include "tools/program/shell_quote.h"
#include "tools/program/text_format.h"

namespace clamor {

namespace {

// Formats as "0.9 kB" or "5.5 MB".
std::string as_size(double bytes) {
  return bytes < 1e5 ? fmt::format("{:.1f} kB", bytes / 1e3)
                     : fmt::format("{:.1f} MB", bytes / 1e6);
}

std::string counted(std::uint64_t count, const char* thing) {
  return fmt::format("{} {}{}", count, thing, count == 1 ? "" : "s");
}

void print_energy(const BakeContents& contents, std::ostream& err) {
  const BakeStatistics& statistics = contents.statistics;
  const double photons = static_cast<double>(std::max<std::uint64_t>(1, statistics.photons_traced));
  const double apart_m = statistics.mean_free_path_m;
  const std::string apart = apart_m > 0 ? fmt::format(", {:.2f} m apart", apart_m) : "";
  const std::string bounces =
      statistics.bounces == 0
          ? "which hit nothing"
          : fmt::format("{:.1f} bounces each{}", static_cast<double>(statistics.bounces) / photons,
                        apart);
  fmt::print(err, "  traced   {}, {}; {:.1f} % escaped with {}\n",
             counted(statistics.photons_traced, "photon"), bounces,
             100 * static_cast<double>(statistics.photons_escaped) / photons,
             in_words(lost_power(statistics, contents.materials)));
}

std::string band_name(std::size_t band) {
  const double hz = kBandCentres_hz[band];
  return hz < 1000 ? fmt::format("{:.0f}", hz) : fmt::format("{:.0f}k", hz / 1000);
}

// Prints T30 per band and its error.
void print_decay(const DecaySummary& decay, std::ostream& err) {
  if (has_no_t30(decay)) {
    fmt::print(err, "  decay    {}\n", kNoT30);
    return;
  }
  std::string bands, times, errors;
  for (std::size_t b = 0; b < kBandCount; ++b) {
    bands += fmt::format("{:>7}", band_name(b));
    times += fmt::format("{:>7}", decay.t30_s[b] > 0 ? fmt::format("{:.2f}", decay.t30_s[b]) : "-");
    errors += fmt::format("{:>7}", decay.t30_s[b] > 0 && decay.t30_error_s[b] > 0
                                       ? fmt::format("{:.{}f}", decay.t30_error_s[b],
                                                     decay.t30_error_s[b] < 99 ? 3 : 0)
                                       : "-");
  }
  fmt::print(err, "  decay    Hz         {}\n           T30, s     {}\n", bands, times);
  if (decay.error_db > 0)
    fmt::print(
        err, "           error, s   {}\n           standard error of the decay curves: {:.2f} dB\n",
        errors, decay.error_db);
}

}  // namespace

void print_bake_summary(const BakeContents& contents, const BakeReport& report,
                        const std::string& output, const std::string& journal, bool removed_journal,
                        double seconds, std::ostream& err) {
  const BakeStatistics& statistics = contents.statistics;
  if (statistics.photons_traced > 0) {
    print_energy(contents, err);
    if (contents.settings.early_order > 0)
      fmt::print(err, "  images   {} of up to {}\n",
                 counted(contents.images.size(), "image source"),
                 counted(static_cast<std::uint64_t>(contents.settings.early_order), "reflection"));
    print_decay(statistics.decay, err);
    if (contents.settings.longest_path_s > kUsualPath_s)
      fmt::print(err, "           so slow that paths of up to {:g} s were traced\n",
                 contents.settings.longest_path_s);
  }
  if (report.photons_reused > 0)
    fmt::print(err, "  reused   {} of {} photons from {}\n", report.photons_reused,
               statistics.photons_traced, journal);
  else if (report.journal_runs > 0 && report.photons > 0)
    fmt::print(
        err,
        "  reused   nothing of {}: surfaces, materials, settings or the emitters' shares of the "
        "photons have changed since it was traced\n",
        journal);
  if (report.instanced_groups > 0)
    fmt::print(err, "  shared   {} have the sources of {}: {} need not be stored\n",
               counted(report.instanced_groups, "emitter group"),
               counted(report.instance_prototypes, "prototype"),
               counted(report.instanced_sources, "source"));
  // A device or pipe has no size, and cannot be played.
  std::error_code no_file;
  const auto bytes = static_cast<double>(std::filesystem::file_size(path_of(output), no_file));
  fmt::print(err, "  wrote    {}: {}{}, {:.1f} s\n", output,
             counted(contents.source_count() + report.instanced_sources, "source"),
             no_file ? "" : " in " + as_size(bytes), seconds);
  const std::string journal_size = as_size(static_cast<double>(report.journal_bytes));
  if (removed_journal)
    fmt::print(err,
               "  removed  {} ({}), which a complete bake needs no more; with --keep-journal, the "
               "next bake traces only more photons or emitters that moved\n",
               journal, journal_size);
  else if (!journal.empty())
    fmt::print(
        err,
        "  kept     {} ({}): the next bake traces only emitters that moved, or everything if a "
        "surface, a material or a setting changes\n",
        journal, journal_size);
  if (!no_file && !contents.emitters.empty())
    fmt::print(err, "  listen   clamor play {}\n", shell_quoted(output));
}

void print_fit(const AbsorptionFit& fit, const MeasuredDecay& measured, const std::string& output,
               std::ostream& err) {
  const auto print_row = [&](std::string_view title, const auto& cell) {
    std::string line;
    for (std::size_t b = 0; b < kBandCount; ++b)
      line += fmt::format("{:>7}", fit.octaves[b] ? cell(b) : "-");
    fmt::print(err, "  {:<30}{}\n", title, line);
  };
  const auto print_times = [&](const char* title, double AbsorptionFit::Octave::*time_s) {
    print_row(title, [&](std::size_t b) {
      const double s = (*fit.octaves[b]).*time_s;
      return s > 0 ? fmt::format("{:.2f}", s) : "-";
    });
  };
  using Octave = AbsorptionFit::Octave;
  std::string bands;
  for (std::size_t b = 0; b < kBandCount; ++b) bands += fmt::format("{:>7}", band_name(b));
  fmt::print(err, "  {:<30}{}\n", fmt::format("fitted {}, Hz", measured.name()), bands);
  print_times("  measured, s", &Octave::measured_s);
  print_times("  before, s", &Octave::before_s);
  print_times("  after, s", &Octave::after_s);
  print_times("  error, s", &Octave::error_s);
  for (const AbsorptionFit::Surface& surface : fit.surfaces) {
    fmt::print(err, "  {}, {:.1f} m2\n", shortened(surface.name, 40), surface.area_m2);
    print_row("  absorption before",
              [&](std::size_t b) { return fmt::format("{:.3f}", surface.before[b]); });
    print_row("  absorption after",
              [&](std::size_t b) { return fmt::format("{:.3f}", surface.after[b]); });
    print_row("  seconds for each 0.01 more",
              [&](std::size_t b) { return fmt::format("{:.2f}", surface.slope_s[b] / 100); });
  }
  if (fit.traces > 1)
    fmt::print(err, "  traced {} times, since paths of the first absorptions end too early\n",
               fit.traces);
  fmt::print(err, "  wrote {}; bake with --acoustics, or as LEVEL.acoustics.json beside it\n",
             output);
}

}  // namespace clamor
