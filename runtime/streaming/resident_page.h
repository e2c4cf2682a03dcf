// resident_page.h: a page of the file in memory, ready for queries.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "formats/bake_file/page_links.h"
#include "runtime/propagation/source_page.h"

namespace clamor {

// An instance of a page. Pages hold them by descending key, so that a traversal can stop.
struct ResidentInstance {
  double key = 0;  // of its representative: power over permanent number
  Placement placement;
  std::uint64_t first = 0;  // number of its first source, from the page's first
  std::uint32_t instance = 0;
};

class ResidentPage {
 public:
  // `entry` is that of the page; `trees` holds the tops of all trees.
  ResidentPage(const PageEntry& entry, SourcePage of_node, PageLinks further,
               std::span<const PageEntry> trees);

  std::size_t bytes() const;

  const SourcePage sources;
  const PageLinks links;
  const std::vector<ResidentInstance> instances;

  // The holder of the highest key in the node and below: the first source, a child, or the first
  // instance.
  enum class HighestKeyIn : std::uint8_t { kSource, kChild, kInstance };
  HighestKeyIn highest_key_in = HighestKeyIn::kSource;
  std::size_t highest_key_child = 0;
};

}  // namespace clamor
