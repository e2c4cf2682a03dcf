// source_finishing.h: completes and sorts the sources of a bake, in memory or on disk.
//
// Threads: the caller's team.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "bake/bake_options.h"
#include "bake/batch_tracing.h"
#include "bake/instances/emitter_instances.h"
#include "bake/octree/source_spill.h"
#include "common/material.h"
#include "common/result.h"
#include "formats/bake_file/bake_contents.h"
#include "formats/bake_file/source.h"

namespace clamor {

// Completes secondary sources: patch radii, and the values that the file can hold.
void finish_sources(std::span<Source> secondary_sources, std::span<const Material> materials);

// Completes the sources of a state of the level, and moves them to `list`, all on disk.
Result<void> finish_on_disk(BatchTracing::Output& traced, const BakeOptions& options,
                            std::uint64_t step_bytes, std::span<const Material> materials,
                            SourceSpill& list);

// Sorts the sources and the instances into the contents' octree, in memory.
void sort_sources(std::vector<Source> sources, EmitterInstances& instances, BakeContents& contents);

// Sorts a list on disk into the contents' octree when they are written.
void sort_on_disk(SourceSpill list, EmitterInstances& instances, std::uint64_t step_bytes,
                  BakeContents& contents);

}  // namespace clamor
