// page_parents.h: detects pages that are children of two nodes.
#pragma once

#include <cstdint>
#include <mutex>
#include <string>
#include <unordered_map>

#include "common/result.h"
#include "formats/bake_file/page_links.h"

namespace clamor {

// Records the parent of every page that was read. In a forged file several nodes could share a
// page, and the number of paths to it could grow exponentially, so a page with two parents is an
// Error. Siblings within one page are checked by page_links.h.
class PageParents {
 public:
  // The empty page of a tree without sources has the offset of whatever comes next.
  void add_top(const PageEntry& top) {
    if (top.page.bytes() > 0) parents_.emplace(top.page.offset, top.page.offset);
  }

  // Thread-safe.
  Result<void> add(const PageEntry& parent, const PageLinks& links) {
    if (links.children.empty()) return {};
    const std::lock_guard lock(mutex_);
    for (const PageEntry& child : links.children) {
      const auto [known, is_new] = parents_.try_emplace(child.page.offset, parent.page.offset);
      if (!is_new && known->second != parent.page.offset)
        return Error("has a child whose page, at " + std::to_string(child.page.offset) +
                     ", is another node's as well");
    }
    return {};
  }

 private:
  std::mutex mutex_;
  std::unordered_map<std::uint64_t, std::uint64_t> parents_;  // by offset; a root is its own parent
};

}  // namespace clamor
