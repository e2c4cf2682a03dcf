// octree_writer.h: the pages of octrees, written children first.
#pragma once

#include <vector>

#include "common/result.h"
#include "formats/file_appender.h"
#include "formats/octree_page.h"

namespace clamor {

struct WrittenTree {
  PageEntry top;
  std::vector<OctreeLevel> levels;  // 0 is the top
};

class OctreeWriter {
 public:
  // `around` what instances may point to beside trees.
  OctreeWriter(FileAppender& appender, int mirror_bits, const PageSurroundings& around)
      : appender_(appender), mirror_bits_(mirror_bits), around_(around) {}

  // A tree that is in memory. Its pages are packed by all threads of the caller's arena. An Error
  // where a reader would refuse a page.
  Result<void> write(const SourceOctree& octree);

  const std::vector<WrittenTree>& trees() const { return trees_; }

 private:
  // Appends a page and completes its entry.
  Result<void> append(std::vector<std::byte> page, const std::vector<PageEntry>& trees,
                      PageEntry& entry);

  FileAppender& appender_;
  const int mirror_bits_;
  const PageSurroundings around_;
  std::vector<WrittenTree> trees_;
};

}  // namespace clamor
