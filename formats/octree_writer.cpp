#include "formats/octree_writer.h"

#include <algorithm>

#include <tbb/parallel_for.h>

#include "formats/page.h"

namespace clamor {

namespace {

constexpr std::size_t kPagesAtOnce = 1024;  // packed in parallel, then written in order

std::vector<std::size_t> depths_of(const std::vector<OctreeNode>& nodes) {
  std::vector<std::size_t> depths(nodes.size(), 0);
  for (std::size_t i = 0; i < nodes.size(); ++i)
    for (const std::uint32_t child : nodes[i].children)
      if (child != kNoNode) depths[child] = depths[i] + 1;
  return depths;
}

}  // namespace

Result<void> OctreeWriter::append(std::vector<std::byte> page, const std::vector<PageEntry>& trees,
                                  PageEntry& entry) {
  const auto section = appender_.append(page);
  if (!section.ok()) return section.error();
  entry.page.offset = section->offset;
  entry.page.hash = section->hash;
  // As a reader will look at it.
  const auto unreadable = [this](const Error& error) {
    return Error("is not written, since nothing could read it: a node " + error.message)
        .in(appender_.path());
  };
  if (const auto good = check_entry(entry, kFirstPageOffset, appender_.offset()); !good.ok())
    return unreadable(good.error());
  PageSurroundings around = around_;
  around.trees = trees;
  PageLinks links;
  const auto good =
      read_links(std::span(page).subspan(entry.page.packed_bytes), entry, around, links);
  return good.ok() ? good : unreadable(good.error());
}

Result<void> OctreeWriter::write(const SourceOctree& octree) {
  const std::vector<OctreeNode>& nodes = octree.nodes;
  std::vector<PageEntry> tops;
  for (const WrittenTree& tree : trees_) tops.push_back(tree.top);

  // Children come after their parents in memory, so from the last to the first they come before.
  WrittenTree written;
  std::vector<PageEntry> entries(nodes.size());
  const std::vector<std::size_t> depths = depths_of(nodes);
  for (std::size_t end = nodes.size(); end > 0;) {
    const std::size_t first = end > kPagesAtOnce ? end - kPagesAtOnce : 0;
    std::vector<std::vector<std::byte>> pages(end - first);
    tbb::parallel_for(first, end, [&](std::size_t i) {
      const OctreeNode& node = nodes[i];
      if (node.source_count > 0)
        pages[i - first] = packed_lightly(encode_page(
            node, std::span(octree.sources).subspan(node.first_source, node.source_count),
            mirror_bits_));
    });
    for (std::size_t i = end; i-- > first;) {
      const OctreeNode& node = nodes[i];
      PageEntry& entry = entries[i];
      static_cast<NodeSummary&>(entry) = node;
      std::vector<std::byte>& page = pages[i - first];
      entry.page.packed_bytes = static_cast<std::uint32_t>(page.size());
      entry.sources_below = node.source_count;
      for (std::size_t octant = 0; octant < 8; ++octant) {
        if (node.children[octant] == kNoNode) continue;
        PageEntry& child = entries[node.children[octant]];
        child.octant = node.divides_space ? static_cast<std::uint8_t>(octant) : kNoOctant;
        put_entry(child, page);
        entry.sources_below += child.sources_below;
        ++entry.page.children;
      }
      for (std::size_t k = 0; k < node.instance_count; ++k) {
        const Instance& instance = octree.instances[node.first_instance + k];
        put_instance(instance, page);
        if (instance.tree < tops.size()) entry.sources_below += tops[instance.tree].sources_below;
        ++entry.page.instances;
      }

      if (depths[i] >= written.levels.size()) written.levels.resize(depths[i] + 1);
      OctreeLevel& level = written.levels[depths[i]];
      ++level.nodes;
      level.sources += node.source_count;
      level.packed_bytes += page.size();
      if (const auto done = append(std::move(page), tops, entry); !done.ok()) return done;
    }
    end = first;
  }
  // In double, over all of a level; the order is that of the sources.
  std::vector<std::array<double, kBandCount>> power(written.levels.size());
  for (std::size_t i = 0; i < nodes.size(); ++i)
    for (std::size_t k = 0; k < nodes[i].source_count; ++k)
      for (std::size_t b = 0; b < kBandCount; ++b)
        power[depths[i]][b] += octree.sources[nodes[i].first_source + k].power[b];
  for (std::size_t d = 0; d < power.size(); ++d)
    for (std::size_t b = 0; b < kBandCount; ++b)
      written.levels[d].power[b] = static_cast<float>(power[d][b]);
  if (!entries.empty()) written.top = entries[0];
  trees_.push_back(std::move(written));
  return {};
}

}  // namespace clamor
