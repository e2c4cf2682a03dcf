// resident_page.h: a page of the file, in memory and ready for the sampler.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "formats/bake_file/page_links.h"
#include "runtime/query/source_page.h"

namespace clamor {

// A copy as a walk meets it: by descending key, so that it can stop.
struct ResidentInstance {
  double key = 0;  // the choice among copies has it: power over number
  Placement placement;
  std::uint64_t first = 0;  // sources of the page and below that are numbered before
  std::uint32_t instance = 0;
};

class ResidentPage {
 public:
  // `entry` is the page's, `trees` the tops of all.
  ResidentPage(const PageEntry& entry, SourcePage of_node, PageLinks further,
               std::span<const PageEntry> trees);

  std::size_t bytes() const;

  const SourcePage sources;
  const PageLinks links;
  const std::vector<ResidentInstance> copies;

  // What is in the node that has the highest key of all: a source, a child, or a copy, by its place
  // in the list above.
  enum class Leader : std::uint8_t { kSource, kChild, kCopy };
  Leader leader = Leader::kSource;
  std::size_t leading_child = 0;  // the copy or the source that leads is the first
};

}  // namespace clamor
