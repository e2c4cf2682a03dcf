#include "formats/bake_file/octree_writer.h"

#include <algorithm>
#include <utility>

#include <tbb/parallel_for.h>

#include "formats/bake_file/page.h"

namespace clamor {

namespace {

constexpr std::size_t kPagesAtOnce = 1024;  // encoded in parallel, then written in order

std::vector<std::size_t> depths_of(const std::vector<OctreeNode>& nodes) {
  std::vector<std::size_t> node_depths(nodes.size(), 0);
  for (std::size_t i = 0; i < nodes.size(); ++i)
    for (const std::uint32_t child : nodes[i].children)
      if (child != kNoNode) node_depths[child] = node_depths[i] + 1;
  return node_depths;
}

// Summary of a parent of two nodes. One of them contains instances, so the cone covers all
// directions.
NodeSummary above(const NodeSummary& a, const NodeSummary& b) {
  NodeSummary node;
  node.low_m = glm::min(a.low_m, b.low_m);
  node.high_m = glm::max(a.high_m, b.high_m);
  node.min_delay_s = std::min(a.min_delay_s, b.min_delay_s);
  node.max_delay_s = std::max(a.max_delay_s, b.max_delay_s);
  node.highest_key = std::max(a.highest_key, b.highest_key);
  for (std::size_t band = 0; band < kBandCount; ++band)
    node.power[band] = a.power[band] + b.power[band];
  return node;
}

}  // namespace

Result<void> OctreeWriter::append(std::vector<std::byte> page, PageEntry& entry) {
  const auto section = appender_.append(page);
  if (!section.ok()) return section.error();
  entry.page.offset = section->offset;
  entry.page.hash = section->hash;
  // Validates the page as a reader would.
  const auto unreadable = [this](const Error& error) {
    return Error("is not written because it would be invalid: a node " + error.message)
        .in(appender_.path());
  };
  if (const auto good = check_entry(entry, kFirstPageOffset, appender_.offset()); !good.ok())
    return unreadable(good.error());
  PageContext around = around_;
  around.trees = tops_;
  PageLinks links;
  const auto good =
      read_links(std::span(page).subspan(entry.page.packed_bytes), entry, around, links);
  return good.ok() ? good : unreadable(good.error());
}

Result<OctreeWriter::Part> OctreeWriter::write_part(const SourceOctree& octree) {
  const std::vector<OctreeNode>& nodes = octree.nodes;
  // Parents precede children in memory, so iterating backwards visits children first.
  Part part;
  std::vector<PageEntry> entries(nodes.size());
  const std::vector<std::size_t> node_depths = depths_of(nodes);
  for (std::size_t end = nodes.size(); end > 0;) {
    const std::size_t first = end > kPagesAtOnce ? end - kPagesAtOnce : 0;
    std::vector<std::vector<std::byte>> pages(end - first);
    tbb::parallel_for(first, end, [&](std::size_t i) {
      const OctreeNode& node = nodes[i];
      if (node.source_count > 0)
        pages[i - first] = zstd_compress_fast(encode_page(
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
        if (instance.tree < tops_.size()) entry.sources_below += tops_[instance.tree].sources_below;
        ++entry.page.instances;
      }

      if (node_depths[i] >= part.depths.size()) part.depths.resize(node_depths[i] + 1);
      OctreeDepth& depth = part.depths[node_depths[i]].counts;
      ++depth.nodes;
      depth.sources += node.source_count;
      depth.packed_bytes += page.size();
      if (const auto done = append(std::move(page), entry); !done.ok()) return done.error();
    }
    end = first;
  }
  for (std::size_t i = 0; i < nodes.size(); ++i)
    for (std::size_t k = 0; k < nodes[i].source_count; ++k)
      for (std::size_t b = 0; b < kBandCount; ++b)
        part.depths[node_depths[i]].power[b] += octree.sources[nodes[i].first_source + k].power[b];
  if (!entries.empty()) part.top = entries[0];
  return part;
}

void OctreeWriter::finish(const Part& part) {
  WrittenTree& tree = trees_.emplace_back();
  tree.top = part.top;
  for (const Depth& depth : part.depths) {
    OctreeDepth& written = tree.depths.emplace_back(depth.counts);
    for (std::size_t b = 0; b < kBandCount; ++b)
      written.power[b] = static_cast<float>(depth.power[b]);
  }
  tops_.push_back(tree.top);
}

Result<void> OctreeWriter::write(const SourceOctree& octree) {
  const auto part = write_part(octree);
  if (!part.ok()) return part.error();
  finish(*part);
  return {};
}

Result<std::size_t> OctreeWriter::add_subtree(SourceOctree&& subtree) {
  auto part = write_part(subtree);
  if (!part.ok()) return part.error();
  parts_.push_back(std::move(*part));
  return parts_.size() - 1;
}

void OctreeWriter::put_below(std::size_t handle, std::uint8_t octant, std::vector<std::byte>& page,
                             Part& above) {
  Part below = std::exchange(parts_[handle], {});
  below.top.octant = octant;
  put_entry(below.top, page);
  above.top.sources_below += below.top.sources_below;
  ++above.top.page.children;
  above.depths.resize(std::max(above.depths.size(), below.depths.size() + 1));
  for (std::size_t d = 0; d < below.depths.size(); ++d) {
    Depth& depth = above.depths[d + 1];
    depth.counts.nodes += below.depths[d].counts.nodes;
    depth.counts.sources += below.depths[d].counts.sources;
    depth.counts.packed_bytes += below.depths[d].counts.packed_bytes;
    for (std::size_t b = 0; b < kBandCount; ++b) depth.power[b] += below.depths[d].power[b];
  }
}

Result<std::size_t> OctreeWriter::add_node(
    const NodeSummary& node, std::span<const Source> sources,
    const std::array<std::optional<std::size_t>, 8>& children) {
  Part part;
  part.depths.resize(1);
  static_cast<NodeSummary&>(part.top) = node;
  std::vector<std::byte> page = zstd_compress_fast(encode_page(node, sources, mirror_bits_));
  part.top.page.packed_bytes = static_cast<std::uint32_t>(page.size());
  part.top.sources_below = sources.size();
  for (std::size_t octant = 0; octant < 8; ++octant)
    if (children[octant])
      put_below(*children[octant], static_cast<std::uint8_t>(octant), page, part);
  Depth& top = part.depths[0];
  top.counts = {1, sources.size(), page.size(), {}};
  for (const Source& source : sources)
    for (std::size_t b = 0; b < kBandCount; ++b) top.power[b] += source.power[b];
  if (const auto done = append(std::move(page), part.top); !done.ok()) return done.error();
  parts_.push_back(std::move(part));
  return parts_.size() - 1;
}

Result<std::size_t> OctreeWriter::add_above(std::size_t first, std::size_t second) {
  Part part;
  part.depths.resize(1);
  static_cast<NodeSummary&>(part.top) = above(parts_[first].top, parts_[second].top);
  std::vector<std::byte> page;
  for (const std::size_t handle : {first, second}) put_below(handle, kNoOctant, page, part);
  part.depths[0].counts = {1, 0, page.size(), {}};
  if (const auto done = append(std::move(page), part.top); !done.ok()) return done.error();
  parts_.push_back(std::move(part));
  return parts_.size() - 1;
}

void OctreeWriter::finish(std::size_t top) { finish(std::exchange(parts_[top], {})); }

}  // namespace clamor
