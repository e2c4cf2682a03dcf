// octree_writer.h: the pages of octrees, written children first.
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
  std::vector<OctreeLevel> levels;  // 0 is the top
};

// Takes trees that are in memory, whole, or one that is not, piece by piece.
class OctreeWriter final : public OctreeSink {
 public:
  // `around` what instances may point to beside trees.
  OctreeWriter(SectionWriter& appender, int mirror_bits, const PageContext& around)
      : appender_(appender), mirror_bits_(mirror_bits), around_(around) {}

  // A tree that is in memory. Its pages are packed by all threads of the caller's arena. An Error
  // where a reader would refuse a page.
  Result<void> write(const SourceOctree& octree);

  Result<std::size_t> add_subtree(SourceOctree&& subtree) override;
  Result<std::size_t> add_node(const NodeSummary& node, std::span<const Source> sources,
                               const std::array<std::optional<std::size_t>, 8>& children) override;
  // A node without sources above two that were added, each an octree of its own.
  Result<std::size_t> add_above(std::size_t first, std::size_t second);
  // What was added is a tree, and this its top.
  void finish(std::size_t top);

  const std::vector<WrittenTree>& trees() const { return trees_; }

 private:
  // Sums of a depth, in double until all is in.
  struct Level {
    OctreeLevel counts;
    std::array<double, kBandCount> power{};
  };
  struct Part {
    PageEntry top;
    std::vector<Level> levels;
  };

  // Puts what was added below a page that is being made.
  void put_below(std::size_t handle, std::uint8_t octant, std::vector<std::byte>& page,
                 Part& above);
  Result<Part> write_part(const SourceOctree& octree);
  void finish(const Part& part);
  // Appends a page and completes its entry.
  Result<void> append(std::vector<std::byte> page, PageEntry& entry);

  SectionWriter& appender_;
  const int mirror_bits_;
  const PageContext around_;
  std::vector<WrittenTree> trees_;
  std::vector<PageEntry> tops_;  // theirs
  std::vector<Part> parts_;      // by handle; those that have a parent are empty
};

}  // namespace clamor
