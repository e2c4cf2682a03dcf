// bake_contents.h: everything that a bake file holds, before it is written.
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <vector>

#include "common/material.h"
#include "common/result.h"
#include "formats/bake_file/bake_metadata.h"
#include "formats/bake_file/baked_portals.h"
#include "formats/bake_file/image_source.h"
#include "formats/bake_file/octree_sink.h"
#include "formats/bake_file/source_octree.h"
#include "formats/level/emitter.h"
#include "formats/level/mesh.h"
#include "formats/level/movable_part.h"
#include "formats/level/signal.h"

namespace clamor {

// The reflections of omnidirectional sources of gain 1: the early ones of each place, and the late
// ones of each zone, for a source anywhere in it. In these sources, which are no emitters,
// Source::emitter is the first leg of the path (first_leg.h), with the set of portals that it
// passed.
struct BakedProbe {
  Vec3 position_m{};
  SourceOctree tree;
  std::uint32_t zone = 0;
};
struct BakedProbes {
  std::vector<BakedProbe> places;
  std::vector<SourceOctree> zones;
};

struct BakeContents {
  BakeSettings settings;
  Provenance provenance;
  BakeStatistics statistics;
  std::vector<Material> materials;
  std::vector<Emitter> emitters;
  std::vector<Signal> signals;
  Mesh mesh;  // for occlusion rays
  std::vector<MovablePart> movable_parts{};
  SourceOctree octree;
  // Streams the octree instead if it does not fit into memory: writes it to the sink and returns
  // the handle of its root. Sources are then only validated per page.
  std::function<Result<std::optional<std::size_t>>(OctreeSink&)> stream_octree;
  std::uint64_t streamed_sources = 0;
  std::uint64_t source_count() const { return octree.sources.size() + streamed_sources; }
  // Trees for instancing: Instance::tree is an index here, less than that of the tree that contains
  // the instance. `octree` may instance any of them.
  std::vector<SourceOctree> prototypes;
  std::vector<std::vector<std::uint32_t>> signal_maps;  // one entry per signal
  BakedProbes probes;
  BakedPortals portals;  // empty without portals
  std::vector<ImageSource> images{};
  Vec3 origin_m{};  // of the level (formats/level/level_origin.h)
};

}  // namespace clamor
