// source_finishing.h: completes and sorts the sources of a bake, in memory or on disk.
//
// Threads: the caller's team.
#pragma once

#include <cstdint>
#include <span>

#include "bake/instances/emitter_instances.h"
#include "bake/octree/scratch_list.h"
#include "bake/portals/portal_sets.h"
#include "common/material.h"
#include "common/result.h"
#include "formats/bake_file/bake_contents.h"
#include "formats/bake_file/source.h"

namespace clamor {

// Completes secondary sources: patch radii, virtual emitters, and the values that the file can
// hold. A list in a file is completed with `step_bytes` of memory.
Result<void> finish_sources(ScratchList<Source>& secondary_sources, const PortalPairs& portals,
                            std::span<const Material> materials, std::uint64_t step_bytes);

// Sorts the sources and the instances into the contents' octree; sources in a file when the
// contents are written.
void sort_sources(ScratchList<Source> sources, EmitterInstances& instances,
                  std::uint64_t step_bytes, BakeContents& contents);

}  // namespace clamor
