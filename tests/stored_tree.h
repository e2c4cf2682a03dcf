// stored_tree.h: octrees in pages as a file stores them, but in memory.
#pragma once

#include <algorithm>
#include <map>
#include <memory>
#include <numeric>
#include <vector>

#include "formats/bake_file/page_links.h"
#include "runtime/propagation/signal_weights.h"
#include "runtime/streaming/page_loader.h"

namespace clamor::testing {

// Trees are added in the order of a file: prototypes of instances first, the level's tree last.
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
        child.octant = node.divides_space ? static_cast<std::uint8_t>(octant) : kNoOctant;
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

  // Signal of each source of all_sources().
  std::vector<std::uint32_t> signals(const std::vector<Emitter>& emitters,
                                     const std::vector<std::vector<std::uint32_t>>& maps) const {
    return tops_.empty() ? std::vector<std::uint32_t>{} : signals_of(tops_.back(), emitters, maps);
  }

  // Sources and signals of any tree, in its own space.
  std::vector<Source> sources_of_tree(std::size_t tree) const { return sources_of(tops_[tree]); }
  std::vector<std::uint32_t> signals_of_tree(
      std::size_t tree, const std::vector<Emitter>& emitters,
      const std::vector<std::vector<std::uint32_t>>& maps) const {
    return signals_of(tops_[tree], emitters, maps);
  }

  const std::vector<PageEntry>& tops() const { return tops_; }
  std::size_t page_count() const { return pages_.size(); }

  // Nodes deeper than `deepest` have no pages. All arguments must outlive the loader.
  PageLoader::Fetch fetch(const RadiationModel& radiation, const SignalWeights& ceilings,
                          int deepest = 1 << 30) const {
    return [this, &radiation, &ceilings, deepest](const PageEntry& entry) -> PageLoader::Content {
      const Page& page = pages_.at(entry.page.offset);
      if (page.depth > deepest) return Error("not here");
      return std::make_unique<const ResidentPage>(
          entry, SourcePage(radiation, ceilings.by_signal, page.sources), page.links, tops_);
    };
  }

  // All sources in the order of their numbers, instanced ones at their places and with their u
  // there.
  std::vector<Source> all_sources() const {
    return tops_.empty() ? std::vector<Source>{} : sources_of(tops_.back());
  }

 private:
  struct Page {
    std::vector<Source> sources;
    PageLinks links;
    int depth = 0;
  };

  std::vector<Source> sources_of(const PageEntry& entry) const {
    const Page& page = pages_.at(entry.page.offset);
    std::vector<Source> all = page.sources;
    for (const PageEntry& child : page.links.children)
      for (const Source& source : sources_of(child)) all.push_back(source);
    for (const Instance& instance : page.links.instances) {
      std::vector<Source> copied = sources_of(tops_[instance.tree]);
      // The representative takes the instance's u (instance.h).
      const auto leader = std::max_element(
          copied.begin(), copied.end(),
          [](const Source& a, const Source& b) { return octree_key(a) < octree_key(b); });
      const double power = std::accumulate(leader->power.begin(), leader->power.end(), 0.0);
      leader->u = static_cast<float>(power * instance.u / total_power(tops_[instance.tree]));
      for (const Source& source : copied) all.push_back(Placement{}.then(instance).place(source));
    }
    return all;
  }

  std::vector<std::uint32_t> signals_of(const PageEntry& entry,
                                        const std::vector<Emitter>& emitters,
                                        const std::vector<std::vector<std::uint32_t>>& maps) const {
    const Page& page = pages_.at(entry.page.offset);
    std::vector<std::uint32_t> all;
    for (const Source& source : page.sources) all.push_back(emitters[source.emitter].signal);
    for (const PageEntry& child : page.links.children)
      for (const std::uint32_t signal : signals_of(child, emitters, maps)) all.push_back(signal);
    for (const Instance& instance : page.links.instances)
      for (const std::uint32_t signal : signals_of(tops_[instance.tree], emitters, maps))
        all.push_back(instance.signals == kSameSignals ? signal : maps[instance.signals][signal]);
    return all;
  }

  std::map<std::uint64_t, Page> pages_;
  std::vector<PageEntry> tops_;
  std::uint64_t next_ = 64;
};

}  // namespace clamor::testing
