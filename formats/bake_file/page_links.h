// page_links.h: child entries and instances of a page.
//
// Each page contains the entries of the children of its node and the instances in it. So the index
// is distributed over the pages: a reader opens a file of any size with the root entry alone, and
// knows every node whose parent it has read. Children and instanced trees precede the pages that
// refer to them, so there are no cycles.
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
inline constexpr std::size_t kMaxTreeLevels = 4096;    // depth of a tree, including its root
inline constexpr std::uint64_t kFirstPageOffset = 64;  // behind the preamble
inline constexpr std::uint8_t kNoOctant = 0xff;  // for children of nodes that do not divide space

struct PageLink {
  std::uint64_t offset = 0, hash = 0;
  std::uint32_t packed_bytes = 0;  // size of the zstd frame; 0 without sources
  std::uint8_t children = 0;
  std::uint16_t instances = 0;

  std::uint64_t bytes() const {
    return packed_bytes + kEntryBytes * children + kInstanceBytes * instances;
  }
  std::uint64_t end() const { return offset + bytes(); }
};

struct PageEntry : NodeSummary {
  std::uint64_t sources_below = 0;  // in the subtree, with instances
  PageLink page;
  std::uint8_t octant = kNoOctant;  // in the cube of the parent
  // Known from traversal, not stored.
  std::uint16_t depth = 0;  // below the root
  bool of_probe = false;    // its sources have first legs in place of emitters (first_leg.h)
  bool of_zone = false;     // and are late reflections
};

// Totals of the nodes of one depth.
struct OctreeDepth {
  std::uint64_t nodes = 0, sources = 0, packed_bytes = 0;
  Bands power{};

  bool operator==(const OctreeDepth&) const = default;
};

// A tree of the reflections of probes: the entry of its top, and totals of its depths.
struct StoredTree {
  PageEntry top;
  std::vector<OctreeDepth> depths;
};

// A place whose early reflections are stored, and the zone that has its late ones.
struct StoredProbe {
  Vec3 position_m{};
  StoredTree tree;
  std::uint32_t zone = 0;
};

// Probes hold what omnidirectional sources of gain 1 leave on the surfaces. Late reflections are
// shared by the probes of a zone.
struct StoredProbes {
  std::vector<StoredProbe> places;
  std::vector<StoredTree> zones;
};

// Power of a node, summed over bands. Over u of an instance, it is the key of the instance.
double total_power(const NodeSummary& node);

// Tables and limits that the links of a page are validated against.
struct PageContext {
  std::span<const PageEntry> trees;
  std::size_t signal_maps = 0, emitters = 0;
};

// Validates an entry: all values in range and the page between `from` and `to` in the file. The
// Error is a predicate: "has bounds that are inverted".
Result<void> check_entry(const PageEntry& entry, std::uint64_t from, std::uint64_t to);

struct PageLinks {
  std::vector<PageEntry> children;
  std::vector<Instance> instances;
};

void put_entry(const PageEntry& entry, std::vector<std::byte>& bytes);
void put_instance(const Instance& instance, std::vector<std::byte>& bytes);

// Decodes the bytes behind the frame of sources. Validates every link by itself and against the
// parent: bounds, keys and counts.
Result<void> read_links(std::span<const std::byte> bytes, const PageEntry& parent,
                        const PageContext& around, PageLinks& links);

// Decodes an entry without validation.
Result<PageEntry> read_entry(std::span<const std::byte> bytes);

// Extends the summary of a node by its instances. Keys are those of instance.h.
void include_instances(std::span<const Instance> instances, std::span<const PageEntry> trees,
                       NodeSummary& node);

}  // namespace clamor
