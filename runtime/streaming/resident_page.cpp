#include "runtime/streaming/resident_page.h"

#include <algorithm>
#include <utility>

namespace clamor {

namespace {

std::vector<ResidentInstance> instances_of(const PageEntry& entry, const PageLinks& links,
                                           std::span<const PageEntry> trees) {
  std::uint64_t first = entry.source_count;
  for (const PageEntry& child : links.children) first += child.sources_below;
  std::vector<ResidentInstance> instances;
  instances.reserve(links.instances.size());
  for (std::uint32_t i = 0; i < links.instances.size(); ++i) {
    const Instance& instance = links.instances[i];
    const PageEntry& tree = trees[instance.tree];
    ResidentInstance resident;
    resident.placement = Placement{}.then(instance);
    resident.key = resident.placement.power * total_power(tree) / instance.u;
    resident.first = first;
    resident.instance = i;
    first += tree.sources_below;
    instances.push_back(resident);
  }
  std::stable_sort(
      instances.begin(), instances.end(),
      [](const ResidentInstance& a, const ResidentInstance& b) { return a.key > b.key; });
  return instances;
}

}  // namespace

ResidentPage::ResidentPage(const PageEntry& entry, SourcePage of_node, PageLinks further,
                           std::span<const PageEntry> trees)
    : sources(std::move(of_node)),
      links(std::move(further)),
      instances(instances_of(entry, links, trees)) {
  double highest = sources.size() > 0 ? octree_key(sources[0]) : -1;
  for (std::size_t c = 0; c < links.children.size(); ++c)
    if (links.children[c].highest_key > highest) {
      highest = links.children[c].highest_key;
      highest_key_in = HighestKeyIn::kChild;
      highest_key_child = c;
    }
  if (!instances.empty() && instances[0].key > highest) highest_key_in = HighestKeyIn::kInstance;
}

std::size_t ResidentPage::bytes() const {
  return sources.bytes() + sizeof(ResidentPage) + links.children.size() * sizeof(PageEntry) +
         links.instances.size() * sizeof(Instance) + instances.size() * sizeof(ResidentInstance);
}

}  // namespace clamor
