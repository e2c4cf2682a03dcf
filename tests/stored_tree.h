// stored_tree.h: octrees as a file would store them, but in memory.
#pragma once

#include <map>
#include <memory>
#include <vector>

#include "formats/octree_page.h"
#include "runtime/page_loader.h"

namespace clamor::testing {

// Trees are added in the order of a file, copied ones first; the last is the level's.
class StoredTrees {
 public:
  void add(const SourceOctree& octree) {
    std::vector<PageEntry> entries(octree.nodes.size());
    std::vector<int> depths(octree.nodes.size(), 0);
    for (std::size_t i = 0; i < octree.nodes.size(); ++i)
      for (const std::uint32_t child : octree.nodes[i].children)
        if (child != kNoNode) depths[child] = depths[i] + 1;
    for (std::size_t i = octree.nodes.size(); i-- > 0;) {
      const OctreeNode& node = octree.nodes[i];
      PageEntry& entry = entries[i];
      static_cast<NodeSummary&>(entry) = node;
      Page& page = pages_[next_];
      page.depth = depths[i];
      const auto first = octree.sources.begin() + static_cast<std::ptrdiff_t>(node.first_source);
      page.sources.assign(first, first + node.source_count);
      entry.sources_below = node.source_count;
      for (std::size_t octant = 0; octant < 8; ++octant) {
        if (node.children[octant] == kNoNode) continue;
        PageEntry& child = entries[node.children[octant]];
        child.octant = static_cast<std::uint8_t>(octant);
        page.links.children.push_back(child);
        entry.sources_below += child.sources_below;
      }
      for (std::uint32_t k = 0; k < node.instance_count; ++k) {
        const Instance& instance = octree.instances[node.first_instance + k];
        page.links.instances.push_back(instance);
        entry.sources_below += tops_[instance.tree].sources_below;
      }
      entry.page.offset = next_++;
    }
    if (!entries.empty()) tops_.push_back(entries[0]);
  }

  const std::vector<PageEntry>& tops() const { return tops_; }
  std::size_t page_count() const { return pages_.size(); }

  // Of nodes deeper than `deepest` there are no pages. All must outlive the loader.
  PageLoader::Fetch fetch(const SourceField& field, const SignalWeights& ceilings,
                          int deepest = 1 << 30) const {
    return [this, &field, &ceilings, deepest](const PageEntry& entry) -> PageLoader::Content {
      const Page& page = pages_.at(entry.page.offset);
      if (page.depth > deepest) return Error("not here");
      return std::make_unique<const ResidentPage>(
          SourcePage(field, ceilings.by_signal, page.sources), page.links);
    };
  }

  // All sources in the order of their numbers, copies where they stand.
  std::vector<Source> all_sources() const {
    std::vector<Source> all;
    if (!tops_.empty()) add_sources(tops_.back(), {}, all);
    return all;
  }

 private:
  struct Page {
    std::vector<Source> sources;
    PageLinks links;
    int depth = 0;
  };

  void add_sources(const PageEntry& entry, const Placement& placement,
                   std::vector<Source>& all) const {
    const Page& page = pages_.at(entry.page.offset);
    for (const Source& source : page.sources) all.push_back(placement.place(source));
    for (const PageEntry& child : page.links.children) add_sources(child, placement, all);
    for (const Instance& instance : page.links.instances)
      add_sources(tops_[instance.tree], placement.then(instance), all);
  }

  std::map<std::uint64_t, Page> pages_;
  std::vector<PageEntry> tops_;
  std::uint64_t next_ = 64;
};

}  // namespace clamor::testing
