// bake_overview.h: totals and groups of what an open bake file holds, in the words that clamor
// inspect, clamor report and others share.
//
// All figures of a file are in its JSON (bake_json.h), which inspect_tables.cpp prints in a
// terminal and the page of a report draws.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "common/material.h"
#include "formats/bake_file/bake_file.h"
#include "formats/bake_file/bake_metadata.h"
#include "formats/level/emitter.h"

namespace clamor {

// Emitters with the same signal, gain and directivity whose names differ only in a final number.
struct EmitterGroup {
  std::string name;
  std::size_t count = 0, first = 0;
  Vec3 low_m{}, high_m{};
  double min_delay_s = 0, max_delay_s = 0;
};

// Materials whose values are equal when rounded for the table.
struct MaterialGroup {
  std::size_t first = 0;
  std::vector<std::string> names;
};

// Trees that the level's tree instances.
struct InstancedTrees {
  std::size_t trees = 0;
  OctreeDepth stored;  // each tree counted once, except `power`, which is that of all instances
};

struct BakeOverview {
  std::vector<OctreeDepth> depths;  // of the level's own tree, by depth
  InstancedTrees instanced;
  Bands power{};                                   // including instances
  std::uint64_t emitter_count = 0, secondary = 0;  // including instances
  std::vector<EmitterGroup> emitters;
  std::vector<MaterialGroup> materials;
  std::string command;  // reproduces the file; "": an application made its level
};

// Reads pages only if there are instances and the root does not say whether anything was traced.
Result<BakeOverview> overview_of(const BakeFile& file);

// Values per octave as they are printed, with their title and unit; "-" for what is not known.
struct BandRow {
  std::string title;
  std::array<std::string, kBandCount> texts;
};

// Decay times and powers: "T30, s", "power emitted, dB" and so on. No T30 where none is known.
std::vector<BandRow> acoustic_rows(const BakeFile& file, const BakeOverview& overview);
bool has_no_t30(const DecaySummary& decay);
inline constexpr const char* kNoT30 = "no T30: too dry, too open, or too few photons";

// "63 Hz", "1 kHz".
std::string band_title(std::size_t band);

// "seed 1, 20 000 photons, ...": the lines of how it was made, each with its title.
struct MakingLine {
  const char* title;
  std::string text;
};
std::vector<MakingLine> making_lines(const BakeFile& file, const BakeOverview& overview);

// Decodes everything and checks the root's totals against the pages. The Error names the first part
// that is damaged.
Result<void> verify(const BakeFile& file);

// Share of the traced photons.
double escaped_share(const BakeStatistics& statistics);

// Returns "fan" for "fan #12", "fan.012" and "fan_12".
std::string without_number(const std::string& name);

std::vector<EmitterGroup> groups_of(std::span<const Emitter> emitters);
std::vector<MaterialGroup> groups_of(std::span<const Material> materials);

}  // namespace clamor
