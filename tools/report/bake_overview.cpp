#include "tools/report/bake_overview.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <filesystem>
#include <functional>
#include <map>
#include <span>
#include <string_view>
#include <tuple>

#include <fmt/format.h>

#include "bake/report/lost_power.h"
#include "common/air.h"
#include "common/utf8_path.h"
#include "common/version.h"
#include "formats/bake_file/signal_envelope.h"
#include "formats/level/mesh.h"
#include "formats/level/signal.h"
#include "tools/program/shell_quote.h"
#include "tools/program/text_format.h"

namespace clamor {

namespace {

std::string command_of(const BakeFile& file) {
  if (file.provenance().tool.starts_with(kLibraryTool)) return "";
  std::string command = "clamor bake " + shell_quoted(file.provenance().level) + " -o " +
                        shell_quoted(path_of(file.path()).filename().string());
  for (const std::string& word : file.provenance().arguments) command += " " + shell_quoted(word);
  return command;
}

void add(const OctreeDepth& level, OctreeDepth& sum) {
  sum.nodes += level.nodes;
  sum.sources += level.sources;
  sum.packed_bytes += level.packed_bytes;
}

bool are_alike(const OctreeDepth& recorded, const OctreeDepth& found) {
  if (recorded.nodes != found.nodes || recorded.sources != found.sources ||
      recorded.packed_bytes != found.packed_bytes)
    return false;
  for (std::size_t b = 0; b < kBandCount; ++b)
    if (std::abs(recorded.power[b] - found.power[b]) >
        1e-3f * std::max(recorded.power[b], found.power[b]))
      return false;
  return true;
}

// Compares the pages that `visit_all` visits with what the root recorded of their trees.
Result<void> verify_trees(const BakeFile& file, std::span<const std::vector<OctreeDepth>> recorded,
                          const char* kind,
                          const std::function<Result<void>(const BakeFile::Visit&)>& visit_all) {
  struct Found {
    OctreeDepth level;
    std::array<double, kBandCount> power{};
  };
  std::vector<std::vector<Found>> found(recorded.size());
  const auto read = visit_all([&](const PageEntry& entry, const OctreePage& page, std::size_t tree,
                                  std::size_t depth) -> Result<void> {
    if (depth >= found[tree].size()) found[tree].resize(depth + 1);
    Found& here = found[tree][depth];
    add({1, entry.source_count, entry.page.bytes(), {}}, here.level);
    for (const Source& source : page.sources)
      for (std::size_t b = 0; b < kBandCount; ++b)
        here.power[b] += static_cast<double>(source.power[b]);
    return {};
  });
  if (!read.ok()) return read;
  for (std::size_t tree = 0; tree < found.size(); ++tree) {
    bool alike = recorded[tree].size() == found[tree].size();
    for (std::size_t d = 0; alike && d < recorded[tree].size(); ++d) {
      for (std::size_t b = 0; b < kBandCount; ++b)
        found[tree][d].level.power[b] = static_cast<float>(found[tree][d].power[b]);
      alike = are_alike(recorded[tree][d], found[tree][d].level);
    }
    if (!alike)
      return Error(file.path() + ": the root's summary of " + kind + " " +
                   std::to_string(tree + 1) + " of " + std::to_string(found.size()) +
                   " does not match its pages. Copy the file again or bake again.");
  }
  return {};
}

Result<void> verify_pages(const BakeFile& file) {
  if (auto trees =
          verify_trees(file, file.depths(), "tree",
                       [&file](const BakeFile::Visit& visit) { return file.for_each_page(visit); });
      !trees.ok())
    return trees;
  std::vector<std::vector<OctreeDepth>> probes;
  for (const StoredProbe& probe : file.probes().places) probes.push_back(probe.tree.depths);
  for (const StoredTree& zone : file.probes().zones) probes.push_back(zone.depths);
  return verify_trees(file, probes, "probe tree", [&file](const BakeFile::Visit& visit) {
    return file.for_each_probe_page(visit);
  });
}

// Returns whether any source is a secondary source. A bake that traced photons has their number;
// other files with instances are decided by their pages.
Result<bool> anything_reflected(const BakeFile& file) {
  if (file.statistics().photons_traced > 0) return true;
  constexpr const char* kEnough = "is enough to know";
  bool found = false;
  const auto read = file.for_each_page(
      [&](const PageEntry&, const OctreePage& page, std::size_t, std::size_t) -> Result<void> {
        found = std::any_of(page.sources.begin(), page.sources.end(),
                            [](const Source& source) { return !source.is_emitter; });
        if (found) return Error(kEnough);
        return {};
      });
  if (!found && !read.ok()) return read.error();
  return found;
}

// Number of emitters among all sources, including instances. With secondary sources, the emitter
// table lists all emitters, because secondary sources refer to it. Without any, every source is an
// emitter, and the table lists only those that are stored.
Result<std::uint64_t> emitters_in(const BakeFile& file) {
  const std::uint64_t listed = std::min<std::uint64_t>(file.source_count(), file.emitters().size());
  if (file.trees().size() < 2) return listed;
  const auto reflected = anything_reflected(file);
  if (!reflected.ok()) return reflected.error();
  return *reflected ? listed : file.source_count();
}

}  // namespace

std::string without_number(const std::string& name) {
  std::size_t end = name.size();
  while (end > 0 && std::isdigit(static_cast<unsigned char>(name[end - 1])) != 0) --end;
  if (end == name.size()) return name;
  while (end > 0 && std::string_view(" #._-").find(name[end - 1]) != std::string_view::npos) --end;
  return end > 0 ? name.substr(0, end) : name;
}

double escaped_share(const BakeStatistics& statistics) {
  return statistics.photons_traced == 0 ? 0
                                        : static_cast<double>(statistics.photons_escaped) /
                                              static_cast<double>(statistics.photons_traced);
}

std::vector<EmitterGroup> groups_of(std::span<const Emitter> emitters) {
  std::vector<EmitterGroup> groups;
  std::map<std::tuple<std::string, std::uint32_t, double, Bands>, std::size_t> known;
  for (std::size_t i = 0; i < emitters.size(); ++i) {
    const Emitter& emitter = emitters[i];
    const std::string name = without_number(emitter.name);
    const auto [place, is_new] =
        known.try_emplace({name, emitter.signal, emitter.gain, emitter.directivity}, groups.size());
    if (is_new)
      groups.push_back(
          {name, 0, i, emitter.position_m, emitter.position_m, emitter.delay_s, emitter.delay_s});
    EmitterGroup& group = groups[place->second];
    ++group.count;
    group.low_m = glm::min(group.low_m, emitter.position_m);
    group.high_m = glm::max(group.high_m, emitter.position_m);
    group.min_delay_s = std::min(group.min_delay_s, emitter.delay_s);
    group.max_delay_s = std::max(group.max_delay_s, emitter.delay_s);
  }
  for (EmitterGroup& group : groups)
    if (group.count == 1) group.name = emitters[group.first].name;
  return groups;
}

std::vector<MaterialGroup> groups_of(std::span<const Material> materials) {
  std::vector<MaterialGroup> groups;
  std::map<std::string, std::size_t> known;
  for (std::size_t i = 0; i < materials.size(); ++i) {
    const Material& material = materials[i];
    std::string looks;
    for (const Bands* bands :
         {&material.absorption, &material.scattering, &material.phong, &material.transmission})
      for (const float value : *bands) looks += fmt::format("{:.2f} ", value);
    const auto [place, is_new] = known.try_emplace(looks, groups.size());
    if (is_new) groups.push_back({i, {}});
    groups[place->second].names.push_back(material.name);
  }
  return groups;
}

bool has_no_t30(const DecaySummary& decay) {
  return std::all_of(decay.t30_s.begin(), decay.t30_s.end(), [](float s) { return s == 0; });
}

std::vector<BandRow> acoustic_rows(const BakeFile& file, const BakeOverview& overview) {
  const BakeStatistics& statistics = file.statistics();
  std::vector<BandRow> rows;
  const auto add_row = [&rows](const char* title, const Bands& values, const auto& text) {
    BandRow row{title, {}};
    for (std::size_t b = 0; b < kBandCount; ++b) row.texts[b] = text(values[b]);
    rows.push_back(std::move(row));
  };
  const auto power = [](float value) {
    constexpr double kMinLevel_db = -99.9;
    const double level_db = decibels_of(static_cast<double>(value));
    return level_db > kMinLevel_db ? fmt::format("{:.1f}", level_db) : "-";
  };
  const auto any = [](const Bands& bands) {
    return *std::max_element(bands.begin(), bands.end()) > 0;
  };
  if (statistics.decay.places > 0 && !has_no_t30(statistics.decay))
    add_row("T30, s", statistics.decay.t30_s,
            [](float t30_s) { return t30_s > 0 ? fmt::format("{:.2f}", t30_s) : "-"; });
  add_row("power emitted, dB", statistics.power_emitted, power);
  add_row("  in all sources, dB", overview.power, power);
  if (any(statistics.power_escaped)) add_row("  escaped, dB", statistics.power_escaped, power);
  if (any(statistics.power_unfinished))
    add_row("  cut at longest path, dB", statistics.power_unfinished, power);
  return rows;
}

std::string band_title(std::size_t band) {
  const double hz = kBandCentres_hz[band];
  return hz < 1000 ? fmt::format("{:.0f} Hz", hz) : fmt::format("{:.0f} kHz", hz / 1000);
}

std::vector<MakingLine> making_lines(const BakeFile& file, const BakeOverview& overview) {
  const BakeSettings& settings = file.settings();
  const BakeStatistics& statistics = file.statistics();
  const double free_path_m = statistics.mean_free_path_m;
  const std::string free_path =
      free_path_m > 0 ? fmt::format("mean free path {:.2f} m, ", free_path_m) : "";
  return {
      {"by",
       overview.command.empty() ? "an application, through libclamor_bake" : overview.command},
      {"settings", fmt::format("seed {}, {}, up to {}, roulette exponent {}, paths up to {} s",
                               settings.seed, counted(settings.photons, "photon"),
                               counted(settings.sources, "secondary source"),
                               settings.roulette_exponent, settings.longest_path_s)},
      {"air", fmt::format("{} C, {} % humidity, {} kPa: sound travels at {:.1f} m/s",
                          settings.air.temperature_c, settings.air.humidity_percent,
                          settings.air.pressure_kpa, speed_of_sound_mps(settings.air))},
      {"traced", fmt::format("{}, {}, {}{:.1f} % escaped with {}",
                             counted(statistics.photons_traced, "photon"),
                             counted(statistics.bounces, "bounce"), free_path,
                             100 * escaped_share(statistics),
                             in_words(lost_power(statistics, file.materials())))},
  };
}

Result<BakeOverview> overview_of(const BakeFile& file) {
  BakeOverview overview;
  const auto emitters = emitters_in(file);
  if (!emitters.ok()) return emitters.error();
  overview.emitter_count = *emitters;
  overview.secondary = file.source_count() - *emitters;
  overview.emitters = groups_of(file.emitters());
  for (EmitterGroup& group : overview.emitters) {
    group.low_m += file.origin_m();
    group.high_m += file.origin_m();
  }
  overview.materials = groups_of(file.materials());
  overview.command = command_of(file);
  if (file.top() == nullptr) return overview;
  overview.power = file.top()->power;
  overview.depths = file.depths().back();
  overview.instanced.trees = file.trees().size() - 1;
  for (std::size_t tree = 0; tree < overview.instanced.trees; ++tree)
    for (const OctreeDepth& level : file.depths()[tree]) add(level, overview.instanced.stored);
  if (overview.instanced.trees == 0) return overview;
  for (std::size_t b = 0; b < kBandCount; ++b) {
    double own = 0;
    for (const OctreeDepth& level : overview.depths) own += static_cast<double>(level.power[b]);
    overview.instanced.stored.power[b] =
        static_cast<float>(std::max(0.0, static_cast<double>(overview.power[b]) - own));
  }
  return overview;
}

Result<void> verify(const BakeFile& file) {
  if (auto pages = verify_pages(file); !pages.ok()) return pages;
  for (std::size_t i = 0; i < file.signal_count(); ++i) {
    if (const auto signal = file.read_signal(i); !signal.ok()) return signal.error();
    if (const auto envelope = file.read_envelope(i); !envelope.ok()) return envelope.error();
  }
  if (const auto mesh = file.read_mesh(); !mesh.ok()) return mesh.error();
  return {};
}

}  // namespace clamor
