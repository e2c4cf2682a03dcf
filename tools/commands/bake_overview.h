// bake_overview.h: what an open bake file holds, added up and put in groups, for clamor inspect.
//
// inspect_tables.cpp prints it for people, inspect_json.cpp for programs.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "common/material.h"
#include "formats/bake_file/bake_file.h"
#include "formats/bake_file/bake_metadata.h"
#include "formats/level/emitter.h"

namespace clamor {

// Emitters of one kind: alike in name but for a number at its end, in signal, gain and directivity.
struct EmitterGroup {
  std::string name;
  std::size_t count = 0, first = 0;
  Vec3 low_m{}, high_m{};
  double min_delay_s = 0, max_delay_s = 0;
};

// Materials that nobody could tell apart.
struct MaterialGroup {
  std::size_t first = 0;
  std::vector<std::string> names;
};

// Trees that the level's tree copies.
struct CopiedTrees {
  std::size_t trees = 0;
  OctreeLevel stored;  // of all of them, each once; the power is what their copies add to the level
};

struct BakeOverview {
  std::vector<OctreeLevel> levels;  // of the level's tree, by depth
  CopiedTrees copied;
  Bands power{};                                   // of all sources, copies too
  std::uint64_t emitter_count = 0, secondary = 0;  // of all sources, copies too
  std::vector<EmitterGroup> emitters;
  std::vector<MaterialGroup> materials;
  std::string command;  // that makes the file again
};

// Reads pages only where copies are and nothing tells whether anything is reflected.
Result<BakeOverview> overview_of(const BakeFile& file);

// Decodes everything there is, and holds what the root says of pages against them. An Error names
// the first that is bad.
Result<void> verify(const BakeFile& file);

// Of all photons that were traced.
double escaped_share(const BakeStatistics& statistics);

// "fan" of "fan #12", "fan.012" and "fan_12".
std::string without_number(const std::string& name);

std::vector<EmitterGroup> groups_of(std::span<const Emitter> emitters);
std::vector<MaterialGroup> groups_of(std::span<const Material> materials);

}  // namespace clamor
