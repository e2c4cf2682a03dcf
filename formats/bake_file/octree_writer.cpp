#include "formats/bake_file/octree_writer.h"

#include <algorithm>
#include <utility>

#include "common/thread_team.h"
#include "formats/bake_file/page.h"

namespace clamor {

namespace {

constexpr std::size_t kPagesAtOnce = 1024;  // encoded in parallel, then written in order

// Whether each node but the first is the child of one node, and comes after it.
bool is_tree(const std::vector<OctreeNode>& nodes) {
  std::vector<bool> has_parent(nodes.size());
  for (std::size_t i = 0; i < nodes.size(); ++i)
    for (const std::uint32_t child : nodes[i].children) {
      if (child == kNoNode) continue;
      if (child <= i || child >= nodes.size() || has_parent[child]) return false;
      has_parent[child] = true;
    }
  return true;
}

// The nodes, each after its children. An octree that is streamed has this order, too, however much
// of it the memory holds.
std::vector<std::size_t> children_first(const std::vector<OctreeNode>& nodes) {
  std::vector<std::size_t> order;
  order.reserve(nodes.size());
  std::vector<std::size_t> left;
  if (!nodes.empty()) left.push_back(0);
  while (!left.empty()) {
    const std::size_t node = left.back();
    left.pop_back();
    order.push_back(node);
    for (const std::uint32_t child : nodes[node].children)
      if (child != kNoNode) left.push_back(child);
  }
  std::reverse(order.begin(), order.end());
  return order;
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

OctreeWriter::Depth OctreeWriter::depth_of(std::span<const Source> sources,
                                           std::size_t packed_bytes) {
  Depth depth{{1, sources.size(), packed_bytes, {}}};
  for (const Source& source : sources)
    for (std::size_t b = 0; b < kBandCount; ++b) depth.power[b] += source.power[b];
  return depth;
}

void OctreeWriter::add_below(const std::vector<Depth>& below, std::vector<Depth>& above) {
  above.resize(std::max(above.size(), below.size() + 1));
  for (std::size_t d = 0; d < below.size(); ++d) {
    Depth& depth = above[d + 1];
    depth.counts.nodes += below[d].counts.nodes;
    depth.counts.sources += below[d].counts.sources;
    depth.counts.packed_bytes += below[d].counts.packed_bytes;
    for (std::size_t b = 0; b < kBandCount; ++b) depth.power[b] += below[d].power[b];
  }
}

Result<OctreeWriter::Part> OctreeWriter::write_part(const SourceOctree& octree) {
  const std::vector<OctreeNode>& nodes = octree.nodes;
  if (!is_tree(nodes))
    return Error("is not written because it would be invalid: its nodes are not a tree")
        .in(appender_.path());
  const std::vector<std::size_t> order = children_first(nodes);
  std::vector<Part> parts(nodes.size());  // empty once they have a parent
  for (std::size_t first = 0; first < order.size(); first += kPagesAtOnce) {
    const std::size_t end = std::min(order.size(), first + kPagesAtOnce);
    std::vector<std::vector<std::byte>> pages(end - first);
    const auto sources_of = [&octree](const OctreeNode& node) {
      return std::span(octree.sources)
          .subspan(static_cast<std::size_t>(node.first_source), node.source_count);
    };
    team_for(first, end, [&](std::size_t i) {
      const OctreeNode& node = nodes[order[i]];
      if (node.source_count > 0)
        pages[i - first] = zstd_compress_fast(encode_page(node, sources_of(node), mirror_bits_));
    });
    for (std::size_t i = first; i < end; ++i) {
      const OctreeNode& node = nodes[order[i]];
      Part& part = parts[order[i]];
      static_cast<NodeSummary&>(part.top) = node;
      std::vector<std::byte>& page = pages[i - first];
      part.top.page.packed_bytes = static_cast<std::uint32_t>(page.size());
      part.top.sources_below = node.source_count;
      part.depths.resize(1);
      for (std::size_t octant = 0; octant < 8; ++octant)
        if (node.children[octant] != kNoNode)
          put_below(std::exchange(parts[node.children[octant]], {}),
                    node.divides_space ? static_cast<std::uint8_t>(octant) : kNoOctant, page, part);
      for (std::size_t k = 0; k < node.instance_count; ++k) {
        const Instance& instance = octree.instances[node.first_instance + k];
        put_instance(instance, page);
        if (instance.tree < tops_.size())
          part.top.sources_below += tops_[instance.tree].sources_below;
        ++part.top.page.instances;
      }
      part.depths[0] = depth_of(sources_of(node), page.size());
      if (const auto done = append(std::move(page), part.top); !done.ok()) return done.error();
    }
  }
  return parts.empty() ? Part{} : std::move(parts[0]);
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

void OctreeWriter::put_below(Part below, std::uint8_t octant, std::vector<std::byte>& page,
                             Part& above) {
  below.top.octant = octant;
  put_entry(below.top, page);
  above.top.sources_below += below.top.sources_below;
  ++above.top.page.children;
  add_below(below.depths, above.depths);
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
      put_below(std::exchange(parts_[*children[octant]], {}), static_cast<std::uint8_t>(octant),
                page, part);
  part.depths[0] = depth_of(sources, page.size());
  if (const auto done = append(std::move(page), part.top); !done.ok()) return done.error();
  parts_.push_back(std::move(part));
  return parts_.size() - 1;
}

Result<std::size_t> OctreeWriter::add_above(std::size_t first, std::size_t second) {
  Part part;
  part.depths.resize(1);
  static_cast<NodeSummary&>(part.top) = above(parts_[first].top, parts_[second].top);
  std::vector<std::byte> page;
  for (const std::size_t handle : {first, second})
    put_below(std::exchange(parts_[handle], {}), kNoOctant, page, part);
  part.depths[0].counts = {1, 0, page.size(), {}};
  if (const auto done = append(std::move(page), part.top); !done.ok()) return done.error();
  parts_.push_back(std::move(part));
  return parts_.size() - 1;
}

void OctreeWriter::finish(std::size_t top) { finish(std::exchange(parts_[top], {})); }

}  // namespace clamor
