// emitter_instances.h: the emitters of a level as sources, those of repeated groups as copies.
//
// Of groups that are congruent (congruent_groups.h) one is stored as a tree of its own, in a few
// variants of its permanent numbers, and the others are copies of it, copies within them too. That
// is done where it makes the file smaller: a copy takes 144 bytes, an emitter some 6 in a page and
// 150 in the table, and each variant is stored whole. So a group is copied if it is large enough
// and there are enough.
//
// Reflections of an emitter name it in the emitter table, so where there are any the table keeps
// every emitter and copies point to their own. Where nothing reflects, the table has only those
// that are stored.
#pragma once

#include <cstdint>
#include <vector>

#include "formats/bake_file/page_links.h"
#include "formats/bake_file/source_octree.h"
#include "formats/level/level.h"
#include "formats/level/scene_group.h"

namespace clamor {

struct EmitterInstances {
  std::vector<SourceOctree> trees;  // each may copy those before it
  std::vector<PageEntry> tops;      // theirs
  std::vector<std::vector<std::uint32_t>> signal_maps;
  std::vector<Instance> instances;     // in the level's own tree
  std::vector<std::uint32_t> alone;    // emitters in no copy, by their numbers in the level
  std::vector<std::uint32_t> numbers;  // of each emitter of the level in the table, if it is in it
  std::vector<Emitter> table;

  std::size_t groups = 0, models = 0;  // that are copies, also within others, and of how many
  std::uint64_t emitters = 0;          // in these
  std::uint64_t stored = 0;            // of which there are sources in the models
};

// `reflected`: whether sources will name emitters. A function of level, groups and seed.
EmitterInstances instance_emitters(const Level& level, const SceneGroups& groups, bool reflected,
                                   std::uint64_t seed);

}  // namespace clamor
