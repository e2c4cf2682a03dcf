// instance_tree.h: trees that are made to be copied, and trees that are made of copies.
//
// instance.h says what a copy is, and why a copied tree needs a representative: exactly one key
// above the tree's power, drawn with probability proportional to power.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "formats/bake_file/page_links.h"
#include "formats/bake_file/source_octree.h"

namespace clamor {

// New permanent numbers for sources that shall be copied: one of them, drawn by power, has a key
// above the power of all; the others have none. Each u is uniform in (0, 1] by itself. A function
// of the powers and the seed; another seed makes another variant.
void draw_prototype_u(std::span<Source> sources, std::uint64_t seed);

// The same for copies of trees, by `number`. `trees` are the tops of those that the bake has.
void draw_prototype_u(std::span<Instance> instances, std::span<const PageEntry> trees,
                      std::uint64_t seed);

// The same for a tree of both: one of all has a key above the power of all.
void draw_prototype_u(std::span<Source> sources, std::span<Instance> instances,
                      std::span<const PageEntry> trees, std::uint64_t seed);

// Numbers of copies that are not copied themselves: uniform in (0, 1].
void draw_instance_u(std::span<Instance> instances, std::uint64_t seed);

// A tree of copies alone, at most kMaxInstances in a node, neighbours together.
SourceOctree instance_tree(std::vector<Instance> instances, std::span<const PageEntry> trees);

// `octree` and copies beside it, as one tree. Either may be empty.
SourceOctree with_instances(SourceOctree octree, std::vector<Instance> instances,
                            std::span<const PageEntry> trees);

// What is known of a tree before it is written: its summary and how many sources it has.
PageEntry root_entry(const SourceOctree& octree, std::span<const PageEntry> trees);

}  // namespace clamor
