// emitter_instances.h: turns a level's emitters into sources and instances of repeated groups.
//
// One of several congruent groups (congruent_groups.h), the prototype, is stored as a tree in a few
// variants that differ in u. The others become instances of it, and groups may be nested.
// Instancing is applied where it makes the file smaller: an instance takes 144 bytes, an emitter
// some 6 bytes in a page and 150 in the table, and each variant is stored in full.
//
// Reflections refer to their emitter in the emitter table. With reflections the table therefore
// holds every emitter, and instances refer to theirs; without, it holds only the stored ones.
#pragma once

#include <cstdint>
#include <vector>

#include "formats/bake_file/page_links.h"
#include "formats/bake_file/source_octree.h"
#include "formats/level/emitter.h"
#include "formats/level/scene_group.h"

namespace clamor {

struct Level;

struct EmitterInstances {
  std::vector<SourceOctree> trees;  // a tree may contain instances of earlier trees
  std::vector<PageEntry> tops;      // root entries of the trees
  std::vector<std::vector<std::uint32_t>> signal_maps;
  std::vector<Instance> instances;     // of the level's own tree
  std::vector<std::uint32_t> alone;    // level indices of emitters outside all instances
  std::vector<std::uint32_t> table_index;  // table index of each emitter of the level, if it has one
  std::vector<Emitter> table;

  // Number of instanced groups, nested ones included, and of their prototypes.
  std::size_t groups = 0, prototypes = 0;
  std::uint64_t emitters = 0;  // emitters in instanced groups
  std::uint64_t stored = 0;    // emitters stored in prototypes
};

// `reflected`: whether secondary sources will refer to emitters. The result depends on level,
// groups and seed alone.
EmitterInstances instance_emitters(const Level& level, const SceneGroups& groups, bool reflected,
                                   std::uint64_t seed);

}  // namespace clamor
