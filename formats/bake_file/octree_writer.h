// octree_writer.h: writes the pages of octrees, children first.
//
// The order of the pages and of all sums is that of the tree: the same whether it is written at
// once or piece by piece, whatever the pieces.
#pragma once

#include <array>
#include <cstddef>
#include <optional>
#include <span>
#include <vector>

#include "common/result.h"
#include "formats/bake_file/octree_sink.h"
#include "formats/bake_file/page_links.h"
#include "formats/bake_file/section_writer.h"

namespace clamor {

struct WrittenTree {
  PageEntry top;
  std::vector<OctreeDepth> depths;  // from the root
};

// Writes octrees in memory, or one octree piece by piece.
class OctreeWriter final : public OctreeSink {
 public:
  // `around` contains the limits of indices in instances.
  OctreeWriter(SectionWriter& appender, int mirror_bits, const PageContext& around)
      : appender_(appender), mirror_bits_(mirror_bits), around_(around) {}

  // Writes an octree in memory, encoding its pages with all threads of the caller's arena. An Error
  // if a reader would reject a page.
  Result<void> write(const SourceOctree& octree);

  Result<std::size_t> add_subtree(SourceOctree&& subtree) override;
  Result<std::size_t> add_node(const NodeSummary& node, std::span<const Source> sources,
                               const std::array<std::optional<std::size_t>, 8>& children) override;
  // Adds a node without sources as parent of two octrees.
  Result<std::size_t> add_above(std::size_t first, std::size_t second);
  // Completes the streamed tree with this root.
  void finish(std::size_t top);

  const std::vector<WrittenTree>& trees() const { return trees_; }

 private:
  // Sums over one depth, in double precision.
  struct Depth {
    OctreeDepth counts;
    std::array<double, kBandCount> power{};
  };
  struct Part {
    PageEntry top;
    std::vector<Depth> depths;
  };

  // Adds a part as child of the node whose page is being created.
  static void put_below(Part below, std::uint8_t octant, std::vector<std::byte>& page, Part& above);
  // Counts of a node with these sources, and those of its children's subtrees.
  static Depth depth_of(std::span<const Source> sources, std::size_t packed_bytes);
  static void add_below(const std::vector<Depth>& below, std::vector<Depth>& above);
  Result<Part> write_part(const SourceOctree& octree);
  void finish(const Part& part);
  // Appends a page and completes its entry.
  Result<void> append(std::vector<std::byte> page, PageEntry& entry);

  SectionWriter& appender_;
  const int mirror_bits_;
  const PageContext around_;
  std::vector<WrittenTree> trees_;
  std::vector<PageEntry> tops_;  // roots of trees_
  std::vector<Part> parts_;      // by handle; empty once they have a parent
};

}  // namespace clamor
