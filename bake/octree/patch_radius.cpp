#include "bake/octree/patch_radius.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <vector>

#include <nanoflann.hpp>
#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>

namespace clamor {

namespace {

constexpr std::size_t kNeighbours = 16;  // including the source itself

double broadband(const Source& source) {
  double sum = 0;
  for (const float power : source.power) sum += power;
  return sum;
}

// The nearest neighbours of a source; of those at the same distance the weaker ones, whatever the
// order in which a tree finds them.
class Neighbours {
 public:
  void add(float distance_squared, double power) {
    std::size_t at = count_;
    if (full() && !is_before(distance_squared, power, kNeighbours - 1)) return;
    if (full())
      at = kNeighbours - 1;
    else
      ++count_;
    for (; at > 0 && is_before(distance_squared, power, at - 1); --at) {
      distance_squared_[at] = distance_squared_[at - 1];
      power_[at] = power_[at - 1];
    }
    distance_squared_[at] = distance_squared;
    power_[at] = power;
  }

  bool full() const { return count_ == kNeighbours; }
  std::size_t size() const { return count_; }
  // No neighbour that counts is farther.
  float farthest_squared() const {
    return full() ? distance_squared_[kNeighbours - 1] : std::numeric_limits<float>::max();
  }

  // The radius of a source with this power.
  float radius_m(double own_power) const {
    // Powers are summed in ascending order, because the order of equidistant neighbours does not
    // matter to them.
    std::array<double, kNeighbours> power = power_;
    std::sort(power.begin(), power.begin() + static_cast<std::ptrdiff_t>(count_));
    double sum = 0;
    for (std::size_t k = 0; k < count_; ++k) sum += power[k];
    const double share = sum > 0 ? std::min(1.0, own_power / sum) : 0;
    const double farthest = distance_squared_[count_ - 1];
    return static_cast<float>(std::sqrt(farthest * share / 2));
  }

 private:
  bool is_before(float distance_squared, double power, std::size_t i) const {
    return distance_squared != distance_squared_[i] ? distance_squared < distance_squared_[i]
                                                    : power < power_[i];
  }

  std::array<float, kNeighbours> distance_squared_{};
  std::array<double, kNeighbours> power_{};
  std::size_t count_ = 0;
};

// A source's place and power. Its neighbours are at least those of its own list.
struct Point {
  Vec3f position_m;
  std::uint32_t index = 0;  // in the list of all sources
  double power = 0;
};

// Adaptors for nanoflann.
struct SourcePoints {
  std::span<const Source> all;
  const Vec3f& place(std::size_t i) const { return all[i].position_m; }
  double power(std::size_t i) const { return broadband(all[i]); }
};
struct ListedPoints {
  std::span<const Point> all;
  const Vec3f& place(std::size_t i) const { return all[i].position_m; }
  double power(std::size_t i) const { return all[i].power; }
};
template <class List>
struct Points : List {
  std::size_t kdtree_get_point_count() const { return this->all.size(); }
  float kdtree_get_pt(std::size_t index, std::size_t axis) const {
    return this->place(index)[static_cast<int>(axis)];
  }
  template <class Box>
  bool kdtree_get_bbox(Box&) const {
    return false;
  }
};

template <class List>
class Tree {
 public:
  explicit Tree(const Points<List>& points)
      : points_(points), tree_(3, points_, nanoflann::KDTreeSingleIndexAdaptorParams(10)) {
    tree_.buildIndex();
  }

  // Adds the points round a place to the neighbours.
  void find(const Vec3f& place_m, Neighbours& neighbours) const {
    Found found{points_, neighbours};
    if constexpr (requires { tree_.findNeighbors(found, &place_m[0]); })
      tree_.findNeighbors(found, &place_m[0]);
    else
      tree_.findNeighbors(found, &place_m[0], nanoflann::SearchParams());
  }

  // The indices in tree order. (nanoflann 1.5 renamed the member.)
  std::size_t in_space(std::size_t at) const { return accessed(tree_)[at]; }

 private:
  // A result set of nanoflann.
  struct Found {
    const Points<List>& points;
    Neighbours& neighbours;

    using DistanceType = float;
    std::size_t size() const { return neighbours.size(); }
    bool full() const { return neighbours.full(); }
    bool empty() const { return neighbours.size() == 0; }
    void sort() const {}
    bool addPoint(float distance_squared, std::size_t index) {
      neighbours.add(distance_squared, points.power(index));
      return true;
    }
    // A little farther than the farthest: the tree drops what is as far, and rounds its bounds.
    float worstDist() const {
      const float farthest = neighbours.farthest_squared();
      return farthest * 1.0001f + std::numeric_limits<float>::min();
    }
  };
  using Index =
      nanoflann::KDTreeSingleIndexAdaptor<nanoflann::L2_Simple_Adaptor<float, Points<List>>,
                                          Points<List>, 3, std::uint32_t>;
  template <class AnyTree>
  static const auto& accessed(const AnyTree& tree) {
    if constexpr (requires { tree.vAcc_; })
      return tree.vAcc_;
    else
      return tree.vAcc;
  }

  Points<List> points_;
  Index tree_;
};

// A part of space with its own list of points.
struct RadiusPart {
  std::array<float, 3> low, high;  // infinite at the level's borders
  ScratchFile file;
  std::vector<Point> buffer{};
  std::uint64_t count = 0;

  float distance_squared(const Vec3f& place_m) const {
    float sum = 0;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const float at = place_m[static_cast<int>(axis)];
      const float beyond = std::max({low[axis] - at, at - high[axis], 0.0f});
      sum += beyond * beyond;
    }
    return sum;
  }
  // Whether a place that is as far from this part may have neighbours in it; bounds are rounded.
  bool may_hold(const Vec3f& place_m, float farthest_squared) const {
    return distance_squared(place_m) <=
           farthest_squared * 1.0001f + std::numeric_limits<float>::min();
  }
  // Whether the neighbours of a place in this part may lie outside.
  bool is_left(const Vec3f& place_m, float farthest_squared) const {
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const float at = place_m[static_cast<int>(axis)];
      const float to_border = std::min(at - low[axis], high[axis] - at);
      if (to_border * to_border <= farthest_squared * 1.0001f + std::numeric_limits<float>::min())
        return true;
    }
    return false;
  }
};

// A source near the border of its part.
struct BorderPoint {
  Point point;
  std::size_t part = 0;
  Neighbours neighbours;
};

class PartedPoints {
 public:
  PartedPoints(std::uint64_t memory_bytes, std::string beside)
      : max_points_(std::max<std::uint64_t>(memory_bytes, 10'000'000) * 6 / 10 / kTreeBytes),
        max_border_(std::max<std::uint64_t>(memory_bytes, 10'000'000) * 3 / 10 /
                    sizeof(BorderPoint)),
        beside_(std::move(beside)) {}

  // Chooses parts from a sample of the points that stand for `count`.
  void divide(std::vector<Vec3f> sample, std::uint64_t count) {
    constexpr float kFar = std::numeric_limits<float>::infinity();
    stands_for_ = static_cast<double>(count) / static_cast<double>(sample.size());
    // Each thread has a part of its own, as long as there are not too many files.
    constexpr std::uint64_t kMostParts = 256;
    const std::uint64_t parts = 2 * count / max_points_ + 1;
    at_once_ = std::clamp<std::uint64_t>(
        kMostParts / parts, 1, static_cast<std::uint64_t>(tbb::this_task_arena::max_concurrency()));
    max_points_ /= at_once_;
    split(std::move(sample), {-kFar, -kFar, -kFar}, {kFar, kFar, kFar});
  }

  Result<void> add(const Point& point) {
    std::size_t at = 0;
    while (splits_[at].part == kNoPart)
      at = point.position_m[splits_[at].axis] < splits_[at].value ? at + 1 : splits_[at].above;
    RadiusPart& part = parts_[splits_[at].part];
    part.buffer.push_back(point);
    ++part.count;
    return part.buffer.size() < kBuffered ? Result<void>() : flush(part);
  }

  Result<void> find_radii(std::span<float> radii) {
    for (RadiusPart& part : parts_)
      if (const auto flushed = flush(part); !flushed.ok()) return flushed;
    for (std::size_t first = 0; first < parts_.size(); first += at_once_) {
      const std::size_t count = std::min<std::size_t>(at_once_, parts_.size() - first);
      std::vector<Result<std::vector<BorderPoint>>> near_border(count, std::vector<BorderPoint>{});
      tbb::parallel_for(std::size_t{0}, count, [&](std::size_t i) {
        const auto points = read(first + i);
        if (!points.ok())
          near_border[i] = points.error();
        else if (!points->empty())
          // A thread that waits for others must not begin another part meanwhile.
          tbb::this_task_arena::isolate(
              [&] { near_border[i] = find_inside(first + i, *points, radii); });
      });
      for (const auto& points : near_border) {
        if (!points.ok()) return points.error();
        for (const BorderPoint& point : *points) {
          border_.push_back(point);
          if (border_.size() < max_border_) continue;
          if (const auto found = find_across(radii); !found.ok()) return found;
        }
      }
    }
    return find_across(radii);
  }

 private:
  static constexpr std::size_t kNoPart = ~std::size_t{0}, kBuffered = 4096;
  static constexpr std::uint64_t kTreeBytes = 24 + 4 + 24 + 8;  // of a point and its share of nodes
  struct Split {
    int axis = 0;
    float value = 0;
    std::size_t above = 0;  // the split below is the next
    std::size_t part = kNoPart;
  };

  void split(std::vector<Vec3f> sample, std::array<float, 3> low, std::array<float, 3> high) {
    const std::size_t here = splits_.size();
    splits_.emplace_back();
    Vec3f least = sample.empty() ? Vec3f{} : sample[0], most = least;
    for (const Vec3f& place : sample) {
      least = glm::min(least, place);
      most = glm::max(most, place);
    }
    int axis = 0;
    for (const int other : {1, 2})
      if (most[other] - least[other] > most[axis] - least[axis]) axis = other;
    // The sample is no more exact than this.
    const double expected = 1.2 * static_cast<double>(sample.size()) * stands_for_;
    if (expected <= static_cast<double>(max_points_) || !(most[axis] > least[axis]) ||
        sample.size() < 64) {
      splits_[here].part = parts_.size();
      parts_.push_back({low, high, ScratchFile(beside_)});
      return;
    }
    const auto middle = sample.begin() + static_cast<std::ptrdiff_t>(sample.size() / 2);
    std::nth_element(sample.begin(), middle, sample.end(),
                     [axis](const Vec3f& a, const Vec3f& b) { return a[axis] < b[axis]; });
    const float value =
        (*middle)[axis] > least[axis] ? (*middle)[axis] : std::nextafter(least[axis], most[axis]);
    splits_[here].axis = axis;
    splits_[here].value = value;
    std::vector<Vec3f> below, above;
    for (const Vec3f& place : sample) (place[axis] < value ? below : above).push_back(place);
    sample = {};
    const auto at = static_cast<std::size_t>(axis);
    auto high_below = high, low_above = low;
    high_below[at] = low_above[at] = value;
    split(std::move(below), low, high_below);
    splits_[here].above = splits_.size();
    split(std::move(above), low_above, high);
  }

  static Result<void> flush(RadiusPart& part) {
    const auto written = part.file.append(std::as_bytes(std::span(part.buffer)));
    part.buffer.clear();
    return written;
  }

  Result<std::vector<Point>> read(std::size_t part) const {
    std::vector<Point> points(parts_[part].count);
    if (const auto done = parts_[part].file.read(0, std::as_writable_bytes(std::span(points)));
        !done.ok())
      return done.error();
    return points;
  }

  // Sets the radii of the points whose neighbours are in this part, and returns the others.
  std::vector<BorderPoint> find_inside(std::size_t p, std::span<const Point> points,
                                       std::span<float> radii) const {
    const Tree<ListedPoints> tree(Points<ListedPoints>{{points}});
    std::vector<std::uint8_t> is_border(points.size());
    tbb::parallel_for(
        tbb::blocked_range<std::size_t>(0, points.size(), 1024), [&](const auto& range) {
          for (std::size_t at = range.begin(); at != range.end(); ++at) {
            const std::size_t i = tree.in_space(at);
            const Point& point = points[i];
            Neighbours neighbours;
            tree.find(point.position_m, neighbours);
            is_border[i] = parts_[p].is_left(point.position_m, neighbours.farthest_squared());
            if (!is_border[i]) radii[point.index] = neighbours.radius_m(point.power);
          }
        });
    std::vector<BorderPoint> border;
    for (std::size_t i = 0; i < points.size(); ++i) {
      if (!is_border[i]) continue;
      BorderPoint& added = border.emplace_back(BorderPoint{points[i], p, {}});
      tree.find(points[i].position_m, added.neighbours);
    }
    return border;
  }

  // Looks for the neighbours of the collected points in the other parts, and sets their radii.
  Result<void> find_across(std::span<float> radii) {
    for (std::size_t p = 0; p < parts_.size() && !border_.empty(); ++p) {
      const RadiusPart& part = parts_[p];
      const auto reaches = [&](const BorderPoint& border) {
        return border.part != p &&
               part.may_hold(border.point.position_m, border.neighbours.farthest_squared());
      };
      if (part.count == 0 || std::none_of(border_.begin(), border_.end(), reaches)) continue;
      const auto points = read(p);
      if (!points.ok()) return points.error();
      const Tree<ListedPoints> tree(Points<ListedPoints>{{*points}});
      tbb::parallel_for(tbb::blocked_range<std::size_t>(0, border_.size(), 64),
                        [&](const auto& range) {
                          for (std::size_t i = range.begin(); i != range.end(); ++i)
                            if (reaches(border_[i]))
                              tree.find(border_[i].point.position_m, border_[i].neighbours);
                        });
    }
    for (const BorderPoint& border : border_)
      radii[border.point.index] = border.neighbours.radius_m(border.point.power);
    border_.clear();
    return {};
  }

  std::uint64_t max_points_, max_border_, at_once_ = 1;
  std::string beside_;
  double stands_for_ = 1;  // points per point of the sample
  std::vector<Split> splits_;
  std::vector<RadiusPart> parts_;
  std::vector<BorderPoint> border_;
};

}  // namespace

void set_patch_radii(std::span<Source> secondary_sources) {
  if (secondary_sources.empty()) return;
  const Tree<SourcePoints> tree(Points<SourcePoints>{{secondary_sources}});

  // Sources are visited in tree order, because neighbours then share cached nodes.
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, secondary_sources.size(), 1024),
                    [&](const auto& range) {
                      for (std::size_t at = range.begin(); at != range.end(); ++at) {
                        Source& source = secondary_sources[tree.in_space(at)];
                        Neighbours neighbours;
                        tree.find(source.position_m, neighbours);
                        source.patch_radius_m = neighbours.radius_m(broadband(source));
                      }
                    });
}

Result<std::span<const float>> patch_radii_on_disk(const ForEachSource& for_each,
                                                   std::uint64_t count, std::uint64_t memory_bytes,
                                                   const std::string& beside, ScratchFile& radii) {
  constexpr std::uint64_t kSample = 100'000;
  const auto mapped = radii.map(count * sizeof(float));
  if (!mapped.ok()) return mapped.error();
  const std::span<float> values(reinterpret_cast<float*>(mapped->data()), count);
  if (count == 0) return std::span<const float>();
  std::vector<Vec3f> sample;
  std::uint64_t seen = 0;
  const std::uint64_t stride = (count + kSample - 1) / kSample;
  const auto sampled = for_each([&](std::span<Source> sources) -> Result<void> {
    for (const Source& source : sources)
      if (seen++ % stride == 0) sample.push_back(source.position_m);
    return {};
  });
  if (!sampled.ok()) return sampled.error();
  PartedPoints parts(memory_bytes, beside);
  parts.divide(std::move(sample), count);
  std::uint32_t index = 0;
  const auto added = for_each([&](std::span<Source> sources) -> Result<void> {
    for (const Source& source : sources)
      if (const auto one = parts.add({source.position_m, index++, broadband(source)}); !one.ok())
        return one;
    return {};
  });
  if (!added.ok()) return added.error();
  if (const auto found = parts.find_radii(values); !found.ok()) return found.error();
  return std::span<const float>(values);
}

}  // namespace clamor
