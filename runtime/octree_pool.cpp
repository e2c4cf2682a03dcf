#include "runtime/octree_pool.h"

#include <algorithm>
#include <cmath>
#include <queue>

namespace clamor {

namespace {

constexpr double kSlack = 1.0001;        // single precision of keys and bounds
constexpr double kGive_m = 0.002;        // quantised positions, 10 km from the origin
constexpr std::size_t kMostAsked = 256;  // pages at a time

}  // namespace

OctreePool::OctreePool(const SourceField& field, const SignalWeights& weights,
                       std::span<const OctreeNode> nodes, std::uint64_t sources, PageLoader& loader)
    : field_(field),
      nodes_(nodes),
      sources_(sources),
      most_per_power_(kSlack * field.most_per_power(weights.by_signal)),
      loader_(loader) {
  if (nodes.empty()) return;
  root_ = OctreeCube::around(Vec3(nodes[0].low_m), Vec3(nodes[0].high_m));
  loader_.load_now(0);
}

double OctreePool::bound(std::uint32_t index, const Vec3& place) const {
  const OctreeNode& node = nodes_[index];
  const Vec3 low(node.low_m), high(node.high_m);
  const Vec3 away = glm::max(glm::max(low - place, place - high), Vec3(0));
  const double near_m = std::max(length(away) - kGive_m, kEmitterRadius_m);
  const double bound = node.highest_key * most_per_power_ / (near_m * near_m);
  if (node.cone_cos > -1) {
    // Seen from anywhere in the ball round the bounds, is the place outside the cone?
    const Vec3 way = place - (low + high) / 2.0;
    const double way_m = length(way), radius_m = length(high - low) / 2 + kGive_m;
    if (way_m > radius_m) {
      const double cos_axis = dot(way, Vec3(node.cone_axis)) / way_m;
      const double widest =
          std::acos(static_cast<double>(node.cone_cos)) + std::asin(radius_m / way_m) + 1e-3;
      if (widest < 3.141 && cos_axis < std::cos(widest)) return 0;
    }
  }
  return bound;
}

void OctreePool::look(const Vec3& place, double threshold, std::vector<FoundSource>& found) {
  place_ = place;
  missed_ = false;
  if (nodes_.empty()) return;
  to_visit_.assign(1, 0);
  while (!to_visit_.empty()) {
    const std::uint32_t index = to_visit_.back();
    to_visit_.pop_back();
    ++visited_;
    if (bound(index, place) < threshold) continue;
    const SourcePage* const page = loader_.use(index);
    if (page == nullptr) {
      missed_ = true;
      continue;
    }
    page->pass(field_, place, threshold, [&](std::size_t i) {
      found.push_back({page, static_cast<std::uint32_t>(i)});
    });
    for (const std::uint32_t child : nodes_[index].children)
      if (child != kNoNode) to_visit_.push_back(child);
  }
}

// Down through the cubes that hold the source, to the first page that is missing and matters.
double OctreePool::unseen_key(const FoundSource& found, const Vec3& place, double tau) {
  if (!missed_) return 0;
  const Vec3 position_m = field_.position_m(found.source());
  OctreeCube cube = root_;
  for (std::uint32_t index = 0; index != kNoNode;) {
    if (bound(index, place) < tau) return 0;
    if (!loader_.is_here(index)) return nodes_[index].highest_key;
    const std::size_t octant = cube.octant_of(position_m);
    index = nodes_[index].children[octant];
    cube = cube.child(octant);
  }
  return 0;
}

// The best first, through pages that are here and those that are not, as their nodes are known.
void OctreePool::add_missing(const Vec3& place, double tau, bool needed,
                             std::vector<WantedPage>& wanted) const {
  const auto less = [](const WantedPage& a, const WantedPage& b) { return a.urgency < b.urgency; };
  std::priority_queue<WantedPage, std::vector<WantedPage>, decltype(less)> best(less);
  best.push({bound(0, place), 0});
  for (std::size_t added = 0; !best.empty() && added < kMostAsked;) {
    const WantedPage next = best.top();
    best.pop();
    if (next.urgency < tau || next.urgency == 0) break;
    if (loader_.has_failed(next.page)) continue;
    if (!loader_.is_here(next.page)) {
      wanted.push_back({next.urgency, next.page, needed});
      ++added;
    }
    for (const std::uint32_t child : nodes_[next.page].children)
      if (child != kNoNode) best.push({bound(child, place), child});
  }
}

void OctreePool::ask(const Vec3& soon, double tau) {
  asked_ = false;
  if (nodes_.empty()) return;
  std::vector<WantedPage> wanted;
  if (missed_) add_missing(place_, tau, true, wanted);
  asked_ = !wanted.empty();
  if (soon != place_) {
    const auto now = static_cast<std::ptrdiff_t>(wanted.size());
    std::vector<WantedPage> later;
    add_missing(soon, tau, false, later);
    for (const WantedPage& one : later)
      if (std::none_of(wanted.begin(), wanted.begin() + now,
                       [&](const WantedPage& known) { return known.page == one.page; }))
        wanted.push_back(one);
  }
  loader_.ask(std::move(wanted));
}

bool OctreePool::complete() { return !asked_ || !loader_.wait(); }

}  // namespace clamor
