// bake_metadata.h: how a bake file was made: settings, provenance and statistics.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "common/air.h"
#include "common/bands.h"
#include "formats/bake_file/level_findings.h"
#include "formats/files/input_file.h"

namespace clamor {

// By Russian roulette, a photon survives with probability (power after / power before)^exponent.
inline constexpr double kRouletteExponent = 0.15;

// Settings that determine the bake. There is no clock, thread count or path among them: the same
// level and settings give the same bytes.
struct BakeSettings {
  std::uint64_t seed = 1;
  std::uint64_t photons = 0;  // 0: chosen from the number of sources
  std::uint64_t sources = 0;  // maximum number of secondary sources; 0: 200 000 per room
  double roulette_exponent = kRouletteExponent;
  double longest_path_s = 10;  // 0: as the level's decay needs
  // Reflections of early specular paths, 0 to kMaxImageOrder; below 0: chosen by their cost.
  int early_order = -1;
  Air air{};
};

struct Provenance {
  std::string tool;   // "clamor 0.1.0"
  std::string level;  // file name without folder
  std::uint64_t input_hash = 0;
  std::vector<std::string> arguments;  // of the command, without level and output
  std::vector<std::string> libraries;  // "zstd 1.5.4": libraries that influence the bytes
  std::vector<InputFile> inputs;       // in order of reading
};

// Energy decay of the level, measured by the bake at a few receivers.
struct DecaySummary {
  std::uint32_t places = 0;  // number of receivers, 0: not measured
  Bands t30_s{};             // mean over receivers; 0 in bands without a measurable decay
  Bands t30_error_s{};       // standard error of t30_s
  float error_db = 0;        // standard error of the decay curves; 0: unknown

  bool operator==(const DecaySummary&) const = default;
};

// Statistics of the tracing, for inspect and for warnings.
struct BakeStatistics {
  std::uint64_t photons_traced = 0;
  std::uint64_t bounces = 0;
  std::uint64_t photons_escaped = 0;
  double mean_free_path_m = 0;  // over all path segments between surfaces
  std::uint32_t rooms = 0;      // that contain emitters, by mutual visibility
  std::uint64_t deposits = 0;   // of the photons, before thinning
  Bands power_emitted{};        // emitted by all emitters
  Bands power_escaped{};        // left the level
  Bands power_unfinished{};     // remaining at longest_path_s
  // By material: power that has arrived at its surfaces, each time that it met them. A material
  // behind the end was not met. Empty: nothing was traced, or an older program did.
  std::vector<Bands> power_arrived;
  std::vector<std::string> warnings;
  LevelFindings findings;
  DecaySummary decay{};
};

}  // namespace clamor
