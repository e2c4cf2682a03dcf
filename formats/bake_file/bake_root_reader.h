// bake_root_reader.h: reads and validates the root of a bake file.
//
// The reader calls it, and the writer before it commits, so every written file can be read. Memory
// is a small multiple of the size of the root, whatever the root claims.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "common/material.h"
#include "common/result.h"
#include "formats/bake_file/bake_metadata.h"
#include "formats/bake_file/baked_portals.h"
#include "formats/bake_file/geometry_section.h"
#include "formats/bake_file/image_source.h"
#include "formats/bake_file/page_links.h"
#include "formats/bake_file/section_writer.h"
#include "formats/level/emitter.h"
#include "formats/level/movable_part.h"

namespace clamor {

struct StoredSignal {
  std::string name;
  bool loop = false;
  float scale = 1;
  std::uint64_t frames = 0;
  std::vector<FileSection> blocks;
  Bands mean_square{};
  FileSection envelope;
};

struct StoredGeometryPage {
  FileSection section;
  GeometryCounts counts;
  bool as_before_3_1 = false;  // format 3.0: one frame with the whole geometry
};

// Upper bound of samples per byte of FLAC; silence reaches 350.
inline constexpr std::uint64_t kMaxFramesPerByte = 1000;
inline constexpr std::size_t kMaxSignals = 65536;
inline constexpr std::size_t kMaxTrees = 65536, kMaxSignalMaps = 65536;

inline constexpr std::size_t kMaxProbes = 65536;

struct BakeRootContents {
  BakeSettings settings;
  Provenance provenance;
  BakeStatistics statistics;
  std::vector<Material> materials;
  std::vector<Emitter> emitters;
  std::vector<StoredSignal> signals;
  std::vector<MovablePart> movable_parts;
  Vec3 geometry_low_m{};
  std::vector<StoredGeometryPage> geometry;
  std::vector<PageEntry> trees;
  std::vector<std::vector<OctreeDepth>> depths;  // per tree
  std::vector<std::vector<std::uint32_t>> signal_maps;
  StoredProbes probes;
  BakedPortals portals;
  std::vector<ImageSource> images;
};

// `message` is the root, 8-byte aligned; sections must lie between the preamble and `end`. The
// Error is a clause: "emitter 'x' is out of range".
Result<BakeRootContents> read_bake_root(std::span<const std::byte> message, std::uint64_t end);

}  // namespace clamor
