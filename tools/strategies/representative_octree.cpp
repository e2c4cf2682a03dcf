#include "tools/strategies/representative_octree.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <queue>

#include "common/bounds.h"
#include "formats/bake_file/source_octree.h"
#include "tools/strategies/importance_sampling.h"

namespace clamor {

namespace {

// Sources closer than a millionth of the level are treated as one place, and divided in turn.
constexpr int kDeepest = OctreeCube::kDeepest;
constexpr double kNearest_m = 1e-3;

}  // namespace

RepresentativeOctree::RepresentativeOctree(std::span<const Point> points, double fall,
                                           std::uint64_t seed)
    : points_(points), fall_(fall) {
  std::vector<std::uint32_t> order;
  Bounds bounds;
  for (std::uint32_t i = 0; i < points.size(); ++i) {
    volumes_.push_back(points[i].volume);
    if (!(points[i].volume > 0)) continue;
    order.push_back(i);
    bounds.add(points[i].position_m);
  }
  if (order.empty()) return;
  const OctreeCube cube = OctreeCube::around(bounds.low_m, bounds.high_m);
  nodes_.emplace_back();
  build(0, order, cube.centre_m, cube.half_edge_m, 0);
  for (std::uint32_t node = static_cast<std::uint32_t>(nodes_.size()); node-- > 0;)
    represent(node, seed);
  points_ = {};
}

// Siblings are contiguous, so all children of a node are made before the first one's children.
void RepresentativeOctree::build(std::uint32_t node, std::span<std::uint32_t> points,
                                 const Vec3& centre_m, double half_m, int depth) {
  if (points.size() == 1) {
    const Point& point = points_[points[0]];
    Node& leaf = nodes_[node];
    leaf.low_m = leaf.high_m = Vec3f(point.position_m);
    leaf.radius_m = static_cast<float>(point.radius_m);
    leaf.point = points[0];
    leaf.volume = point.volume;
    return;
  }
  const OctreeCube cube{centre_m, half_m, depth};
  std::array<std::span<std::uint32_t>, 8> parts;
  if (depth < kDeepest) {
    const auto octant = [&](std::uint32_t i) { return cube.octant_of(points_[i].position_m); };
    std::stable_sort(points.begin(), points.end(),
                     [&](std::uint32_t a, std::uint32_t b) { return octant(a) < octant(b); });
    for (std::size_t o = 0, first = 0; o < 8; ++o) {
      std::size_t last = first;
      while (last < points.size() && octant(points[last]) == o) ++last;
      parts[o] = points.subspan(first, last - first);
      first = last;
    }
  } else {
    for (std::size_t o = 0; o < 8; ++o)
      parts[o] = points.subspan(points.size() * o / 8,
                                points.size() * (o + 1) / 8 - points.size() * o / 8);
  }
  const auto full = std::count_if(parts.begin(), parts.end(), [](auto p) { return !p.empty(); });
  if (full == 1) {  // skip chains of single children
    const auto o = static_cast<std::size_t>(
        std::find_if(parts.begin(), parts.end(), [](auto p) { return !p.empty(); }) -
        parts.begin());
    const OctreeCube below = cube.child(o);
    build(node, points, below.centre_m, below.half_edge_m, depth + 1);
    return;
  }
  const auto first_child = static_cast<std::uint32_t>(nodes_.size());
  nodes_[node].first_child = first_child;
  nodes_[node].children = static_cast<std::uint32_t>(full);
  nodes_.resize(nodes_.size() + static_cast<std::size_t>(full));
  for (std::size_t o = 0, child = first_child; o < 8; ++o) {
    if (parts[o].empty()) continue;
    const OctreeCube below = cube.child(o);
    build(static_cast<std::uint32_t>(child++), parts[o], below.centre_m, below.half_edge_m,
          std::min(depth + 1, kDeepest));
  }
}

void RepresentativeOctree::represent(std::uint32_t index, std::uint64_t seed) {
  Node& node = nodes_[index];
  if (node.children == 0) return;
  const std::span<const Node> children(&nodes_[node.first_child], node.children);
  node.low_m = children[0].low_m;
  node.high_m = children[0].high_m;
  node.radius_m = children[0].radius_m;
  node.volume = 0;
  for (const Node& child : children) {
    node.low_m = glm::min(node.low_m, child.low_m);
    node.high_m = glm::max(node.high_m, child.high_m);
    node.radius_m = std::min(node.radius_m, child.radius_m);
    node.volume += child.volume;
  }
  // Drawing numbers above those of the keyframes.
  double at = Draws(seed, (std::uint64_t{1} << 32) + index).next() * node.volume;
  node.point = children.back().point;
  for (const Node& child : children) {
    if (at < child.volume) {
      node.point = child.point;
      break;
    }
    at -= child.volume;
  }
}

double RepresentativeOctree::importance(const Node& node, const Vec3& place,
                                        const Reception& reception) const {
  const Vec3 away =
      glm::max(glm::max(Vec3(node.low_m) - place, place - Vec3(node.high_m)), Vec3(0));
  const double r_m = std::max({length(away), static_cast<double>(node.radius_m), kNearest_m});
  const double volume = node.volume / std::pow(r_m, fall_);
  if (reception.is_omnidirectional() || away == Vec3(0)) return volume;
  const Bands heard = reception.share(Vec3f((Vec3(node.low_m) + Vec3(node.high_m)) / 2.0 - place));
  const double share = std::accumulate(heard.begin(), heard.end(), 0.0) / kBandCount;
  return volume * std::pow(share, fall_ / 2);
}

std::vector<RepresentativeOctree::Representative> RepresentativeOctree::cut(
    const Vec3& place, std::size_t k, const Reception& reception) const {
  struct Entry {
    double importance;
    std::uint32_t node;
    bool operator<(const Entry& other) const {
      return importance != other.importance ? importance < other.importance : node > other.node;
    }
  };
  std::vector<Representative> sample;
  if (nodes_.empty() || k == 0) return sample;
  const auto take = [&](const Node& node) {
    sample.push_back({node.point, node.children == 0 ? 1 : node.volume / volumes_[node.point]});
  };
  std::priority_queue<Entry> queue;  // of nodes that can be opened
  const auto put = [&](std::uint32_t index) {
    const Node& node = nodes_[index];
    if (node.children == 0)
      take(node);
    else
      queue.push({importance(node, place, reception), index});
  };
  put(0);
  while (!queue.empty()) {
    const Node& node = nodes_[queue.top().node];
    if (sample.size() + queue.size() - 1 + node.children > k) break;
    queue.pop();
    for (std::uint32_t c = 0; c < node.children; ++c) put(node.first_child + c);
  }
  for (; !queue.empty(); queue.pop()) take(nodes_[queue.top().node]);
  std::sort(sample.begin(), sample.end(),
            [](const auto& a, const auto& b) { return a.point < b.point; });
  return sample;
}

}  // namespace clamor
