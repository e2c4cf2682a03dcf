// resident_page.h: a page of the file, in memory and ready for the sampler.
#pragma once

#include <cstddef>
#include <utility>

#include "formats/octree_page.h"
#include "runtime/source_page.h"

namespace clamor {

struct ResidentPage {
  ResidentPage(SourcePage of_node, PageLinks further)
      : sources(std::move(of_node)), links(std::move(further)) {}

  std::size_t bytes() const {
    return sources.bytes() + sizeof(ResidentPage) + links.children.size() * sizeof(PageEntry) +
           links.instances.size() * sizeof(Instance);
  }

  const SourcePage sources;
  const PageLinks links;
};

}  // namespace clamor
