// instance_tree.h: builds prototype trees and trees of instances.
//
// An instanced tree needs a representative (instance.h): exactly one source whose key exceeds the
// tree's total power, drawn with probability proportional to power.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "formats/bake_file/page_links.h"
#include "formats/bake_file/source_octree.h"

namespace clamor {

// Draws u of a prototype's sources. One source, drawn by power, gets a key above the total power
// and the others get lower keys; each u by itself is uniform in (0, 1]. Another seed makes another
// variant.
void draw_prototype_u(std::span<Source> sources, std::uint64_t seed);

// Draws u of a prototype that consists of instances. `trees` are the root entries of all trees.
void draw_prototype_u(std::span<Instance> instances, std::span<const PageEntry> trees,
                      std::uint64_t seed);

// Draws u of a prototype of sources and instances; one key of all exceeds the total power.
void draw_prototype_u(std::span<Source> sources, std::span<Instance> instances,
                      std::span<const PageEntry> trees, std::uint64_t seed);

// Draws independent u, uniform in (0, 1], for instances outside prototypes.
void draw_instance_u(std::span<Instance> instances, std::uint64_t seed);

// Builds a tree of instances, at most kMaxInstances per node, neighbours together.
SourceOctree instance_tree(std::vector<Instance> instances, std::span<const PageEntry> trees);

// Joins `octree` and a tree of the instances under a new root. Either may be empty.
SourceOctree with_instances(SourceOctree octree, std::vector<Instance> instances,
                            std::span<const PageEntry> trees);

// The page entry of a tree's root before the tree is written: its summary and source count.
PageEntry root_entry(const SourceOctree& octree, std::span<const PageEntry> trees);

}  // namespace clamor
