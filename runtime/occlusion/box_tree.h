// box_tree.h: a tree of axis-aligned boxes, for searches that rays cannot do.
//
// Items are sorted along a Morton curve, and eight neighbours at a time have a box around them, as
// have eight boxes, and so on. The boxes of eight neighbours are stored coordinate by coordinate,
// so that a search compares them at once.
//
// Threads: any; nothing changes after the constructor.   Memory: 8 bytes per item.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <queue>
#include <span>
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
      levels_.emplace_back(boxes);
    } while (boxes.size() > 1);
  }

  // Calls visit(item) for all items in boxes that overlap one of `around` and for which
  // may_have(box) holds.
  template <class MayHave, class Visit>
  void find(std::span<const Boundsf> around, const MayHave& may_have, const Visit& visit) const {
    if (!levels_.empty()) find(levels_.size(), 0, around, may_have, visit);
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
    struct Next {
      double distance;
      std::uint32_t what, index;

      bool operator<(const Next& other) const {  // the nearest has the highest priority
        if (distance != other.distance) return distance > other.distance;
        return what != other.what ? what > other.what : index > other.index;
      }
    };
    std::priority_queue<Next> queue;
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
            add(bound_of_box(levels_[level - 2].box(child)), kBox + level - 2, child);
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

  // The boxes of a level, by eight of them, then by axis. Empty boxes fill up the last eight.
  struct Level {
    using Rows = std::array<std::array<float, kGroup>, 3>;
    struct Group {
      Rows low_m, high_m;
    };
    std::size_t size;
    std::vector<Group> groups;

    explicit Level(const std::vector<Boundsf>& boxes)
        : size(boxes.size()), groups((size + kGroup - 1) / kGroup) {
      for (std::size_t i = 0; i < kGroup * groups.size(); ++i) {
        const Boundsf box = i < size ? boxes[i] : Boundsf();
        for (std::size_t axis = 0; axis < 3; ++axis) {
          const auto component = static_cast<glm::length_t>(axis);
          groups[i / kGroup].low_m[axis][i % kGroup] = box.low_m[component];
          groups[i / kGroup].high_m[axis][i % kGroup] = box.high_m[component];
        }
      }
    }

    Boundsf box(std::size_t i) const {
      const auto at = [&](const Rows& rows) {
        return Vec3f(rows[0][i % kGroup], rows[1][i % kGroup], rows[2][i % kGroup]);
      };
      return {at(groups[i / kGroup].low_m), at(groups[i / kGroup].high_m)};
    }

    // For each box of the group how far it is from the other along the axis where it is farthest:
    // not positive if they overlap. Compilers make vector instructions of this loop.
    std::array<float, kGroup> gaps_m(std::size_t group, const Boundsf& other) const {
      const auto& [low_m, high_m] = groups[group];
      std::array<float, kGroup> gaps;
      for (std::size_t i = 0; i < kGroup; ++i) {
        const float x = std::max(low_m[0][i] - other.high_m.x, other.low_m.x - high_m[0][i]);
        const float y = std::max(low_m[1][i] - other.high_m.y, other.low_m.y - high_m[1][i]);
        const float z = std::max(low_m[2][i] - other.high_m.z, other.low_m.z - high_m[2][i]);
        gaps[i] = std::max(std::max(x, y), z);
      }
      return gaps;
    }
  };

  // The children of a box of level l are boxes of level l - 1, of level 0 items_.
  template <class Act>
  void for_children(std::size_t level, std::size_t index, const Act& act) const {
    const std::size_t all = level == 1 ? items_.size() : levels_[level - 2].size;
    for (std::size_t i = index * kGroup; i < std::min(all, (index + 1) * kGroup); ++i) act(i);
  }

  // Searches the boxes of a group of the level.
  template <class MayHave, class Visit>
  void find(std::size_t level, std::size_t group, std::span<const Boundsf> around,
            const MayHave& may_have, const Visit& visit) const {
    std::array<float, kGroup> gaps_m = levels_[level - 1].gaps_m(group, around[0]);
    for (const Boundsf& other : around.subspan(1)) {
      const std::array<float, kGroup> more_m = levels_[level - 1].gaps_m(group, other);
      for (std::size_t i = 0; i < kGroup; ++i) gaps_m[i] = std::min(gaps_m[i], more_m[i]);
    }
    for (std::size_t i = 0; i < kGroup; ++i) {
      const std::size_t box = kGroup * group + i;
      if (gaps_m[i] > 0 || !may_have(levels_[level - 1].box(box))) continue;
      if (level > 1)
        find(level - 1, box, around, may_have, visit);
      else
        for_children(1, box, [&](std::size_t child) { visit(std::size_t{items_[child]}); });
    }
  }

  std::vector<std::uint32_t> items_;  // in Morton order
  std::vector<Level> levels_;         // level 1 and up
};

}  // namespace clamor
