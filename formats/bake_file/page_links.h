// page_links.h: what a page of the file says beside its sources: where its children are.
//
// Each page carries the entries of its node's children, and the copies of other trees that stand in
// it. So the index is in the pages: a reader opens a file of any size with one entry, the top's,
// and knows of every node whose parent's page it has. Children and copied trees come before a page
// that speaks of them, so there are no cycles.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "common/result.h"
#include "formats/bake_file/instance.h"
#include "formats/bake_file/source_octree.h"

namespace clamor {

inline constexpr std::size_t kEntryBytes = 120, kInstanceBytes = 72;
inline constexpr std::size_t kMaxChildren = 64, kMaxInstances = 512;
inline constexpr std::size_t kMaxTreeLevels = 4096;    // of nodes in a tree, its top included
inline constexpr std::uint64_t kFirstPageOffset = 64;  // after the preamble
inline constexpr std::uint8_t kNoOctant = 0xff;        // of a child that divides no cube

struct PageLink {
  std::uint64_t offset = 0, hash = 0;
  std::uint32_t packed_bytes = 0;  // of the sources' zstd frame; 0 without sources
  std::uint8_t children = 0;
  std::uint16_t instances = 0;

  std::uint64_t bytes() const {
    return packed_bytes + kEntryBytes * children + kInstanceBytes * instances;
  }
  std::uint64_t end() const { return offset + bytes(); }
};

struct PageEntry : NodeSummary {
  std::uint64_t sources_below = 0;  // in it and below, those of copies too
  PageLink page;
  std::uint8_t octant = kNoOctant;  // of the parent's cube
  std::uint16_t depth = 0;          // below its tree's top; told by the way there, not stored
};

// What the nodes of one depth hold.
struct OctreeLevel {
  std::uint64_t nodes = 0, sources = 0, packed_bytes = 0;
  Bands power{};

  bool operator==(const OctreeLevel&) const = default;
};

// The power of a node over all bands: what its copies have for a key, over their number.
double total_power(const NodeSummary& node);

// What the entries of a page must agree with.
struct PageContext {
  std::span<const PageEntry> trees;
  std::size_t signal_maps = 0, emitters = 0;
};

// An entry by itself: everything in range, the page between `from` and `to` in the file. An Error
// is half a sentence: "has a box that is inside out".
Result<void> check_entry(const PageEntry& entry, std::uint64_t from, std::uint64_t to);

struct PageLinks {
  std::vector<PageEntry> children;
  std::vector<Instance> instances;
};

void put_entry(const PageEntry& entry, std::vector<std::byte>& bytes);
void put_instance(const Instance& instance, std::vector<std::byte>& bytes);

// `bytes`: those after the frame of sources, of a page with this entry. Checked one by one and
// against their parent: bounds, keys and counts.
Result<void> read_links(std::span<const std::byte> bytes, const PageEntry& parent,
                        const PageContext& around, PageLinks& links);

// A single entry, unchecked but for its size.
Result<PageEntry> read_entry(std::span<const std::byte> bytes);

// Adds to the summary of a node what its copies and their tops are. Power is the caller's to add
// first; keys are those of instance.h.
void include_instances(std::span<const Instance> instances, std::span<const PageEntry> trees,
                       NodeSummary& node);

}  // namespace clamor
