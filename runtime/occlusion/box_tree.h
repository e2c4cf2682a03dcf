// box_tree.h: a tree of axis-aligned boxes, for searches that rays cannot do.
//
// Items are sorted along a Morton curve, and eight neighbours at a time have a box around them, as
// have eight boxes, and so on.
//
// Threads: any; nothing changes after the constructor.   Memory: 8 bytes per item.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <queue>
#include <span>
#include <tuple>
#include <utility>
#include <vector>

#include "common/bounds.h"
#include "common/morton_order.h"
#include "common/vec.h"

namespace clamor {

// Distance of a point to the box; zero inside.
inline double distance_m(const Vec3& point_m, const Boundsf& box) {
  return std::sqrt(box.distance2_m2(point_m));
}

// Lower bound of the lengths of paths from one point by way of the box to another. The sum of the
// distances from both is convex, so it is nowhere below its tangent in the middle of the box.
inline double min_path_m(const Vec3& from_m, const Vec3& to_m, const Boundsf& box) {
  constexpr double kRounding = 1e-12;
  const Vec3 low_m(box.low_m), high_m(box.high_m), middle_m = 0.5 * (low_m + high_m);
  const Vec3 before_m = middle_m - from_m, beyond_m = middle_m - to_m;
  const double first_m = length(before_m), second_m = length(beyond_m);
  const double straight_m = distance_m(from_m, box) + distance_m(to_m, box);
  if (!(first_m > 0 && second_m > 0)) return straight_m;
  const Vec3 slope = before_m / first_m + beyond_m / second_m;
  const double tangent_m = (1 - kRounding) * (first_m + second_m) -
                           (1 + kRounding) * dot(glm::abs(slope), 0.5 * (high_m - low_m));
  return std::max(straight_m, tangent_m);
}

class BoxTree {
 public:
  BoxTree() = default;

  explicit BoxTree(std::span<const Boundsf> items) {
    std::vector<Vec3> middles_m;
    for (const Boundsf& item : items)
      middles_m.push_back(0.5 * (Vec3(item.low_m) + Vec3(item.high_m)));
    std::vector<Boundsf> boxes;
    for (const std::size_t item : morton_order(middles_m)) {
      items_.push_back(static_cast<std::uint32_t>(item));
      boxes.push_back(items[item]);
    }
    if (boxes.empty()) return;
    do {
      boxes = grouped(boxes);
      levels_.push_back(boxes);
    } while (boxes.size() > 1);
  }

  // Calls visit(item) for all items in boxes for which touches(box) holds.
  template <class Touches, class Visit>
  void find(const Touches& touches, const Visit& visit) const {
    if (!levels_.empty()) find(levels_.size(), 0, touches, visit);
  }

  // Calls visit(item, distance) in the order of distances until it returns false or distances
  // exceed `limit`. bound_of_box(box) and bound_of_item(item) are lower bounds of the distances of
  // items, and distance_to_item(item) is nothing for items to be left out. That is asked only for
  // items whose bound is among the smallest.
  template <class OfBox, class OfItem, class ToItem, class Visit>
  void find_nearest(double limit, const OfBox& bound_of_box, const OfItem& bound_of_item,
                    const ToItem& distance_to_item, const Visit& visit) const {
    if (levels_.empty()) return;
    // The queue holds visits, items with a bound of their distance, and boxes of a level from kBox
    // on.
    enum : std::uint32_t { kVisit, kItem, kBox };
    using Next = std::tuple<double, std::uint32_t, std::uint32_t>;  // distance, what, index
    std::priority_queue<Next, std::vector<Next>, std::greater<>> queue;
    const auto add = [&](double distance, std::size_t what, std::size_t index) {
      if (distance <= limit)
        queue.push({distance, static_cast<std::uint32_t>(what), static_cast<std::uint32_t>(index)});
    };
    add(0, kBox + levels_.size() - 1, 0);
    while (!queue.empty()) {
      const auto [distance, what, index] = queue.top();
      queue.pop();
      if (what == kVisit) {
        if (!visit(std::size_t{index}, distance)) return;
      } else if (what == kItem) {
        if (const std::optional<double> exact = distance_to_item(std::size_t{index}))
          add(*exact, kVisit, index);
      } else {
        const std::size_t level = what - kBox + 1;
        for_children(level, index, [&](std::size_t child) {
          if (level > 1)
            add(bound_of_box(levels_[level - 2][child]), kBox + level - 2, child);
          else
            add(bound_of_item(std::size_t{items_[child]}), kItem, items_[child]);
        });
      }
    }
  }

 private:
  static constexpr std::size_t kGroup = 8;

  static std::vector<Boundsf> grouped(const std::vector<Boundsf>& boxes) {
    std::vector<Boundsf> groups;
    for (std::size_t i = 0; i < boxes.size(); ++i) {
      if (i % kGroup == 0) groups.emplace_back();
      groups.back().add(boxes[i]);
    }
    return groups;
  }

  // The children of a box of level l are boxes of level l - 1, of level 0 items_.
  template <class Act>
  void for_children(std::size_t level, std::size_t index, const Act& act) const {
    const std::size_t all = level == 1 ? items_.size() : levels_[level - 2].size();
    for (std::size_t i = index * kGroup; i < std::min(all, (index + 1) * kGroup); ++i) act(i);
  }

  template <class Touches, class Visit>
  void find(std::size_t level, std::size_t index, const Touches& touches,
            const Visit& visit) const {
    if (!touches(levels_[level - 1][index])) return;
    for_children(level, index, [&](std::size_t child) {
      if (level > 1)
        find(level - 1, child, touches, visit);
      else
        visit(items_[child]);
    });
  }

  std::vector<std::uint32_t> items_;          // in Morton order
  std::vector<std::vector<Boundsf>> levels_;  // level 1 and up
};

}  // namespace clamor
