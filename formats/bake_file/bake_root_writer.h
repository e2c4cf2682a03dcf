// bake_root_writer.h: encodes the root of a bake file.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "common/bands.h"
#include "common/vec.h"
#include "formats/bake_file/bake_root_reader.h"
#include "formats/bake_file/octree_writer.h"
#include "formats/bake_file/section_writer.h"

namespace clamor {

struct BakeContents;

struct SignalSections {
  float scale = 1;
  std::vector<FileSection> blocks;
  Bands mean_square{};
  FileSection envelope;
};

// Locations of the parts of the file before its root.
struct BakeSections {
  std::vector<SignalSections> signals;
  FileSection geometry;  // empty; used by format 3.0 only
  Vec3 geometry_low_m{};
  std::vector<StoredGeometryPage> geometry_pages;
  std::uint64_t bytes_before_root = 0;
};

// Returns a Cap'n Proto message, a function of its arguments alone. `probe_trees` are those of
// contents.probes.
std::vector<std::byte> encode_bake_root(const BakeContents& contents, const BakeSections& sections,
                                        std::span<const WrittenTree> trees,
                                        std::span<const WrittenTree> probe_trees);

// "Cap'n Proto 0.9.2".
std::string root_library_version();

}  // namespace clamor
