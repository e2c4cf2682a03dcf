#include "bake/octree/patch_radius_on_disk.h"

#include <algorithm>
#include <array>
#include <limits>
#include <vector>

#include "bake/octree/nearest_neighbours.h"
#include "bake/octree/patch_radius.h"
#include "bake/octree/point_runs.h"
#include "common/thread_team.h"

namespace clamor {

namespace {

// A part of space with its own list of points.
struct RadiusPart {
  std::array<float, 3> low, high;  // infinite at the level's borders
  ScratchFile file;
  std::vector<PowerPoint> buffer{};
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
    return distance_squared(place_m) <= loosened(farthest_squared);
  }
  // Whether the neighbours of a place in this part may lie outside.
  bool is_left(const Vec3f& place_m, float farthest_squared) const {
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const float at = place_m[static_cast<int>(axis)];
      const float to_border = std::min(at - low[axis], high[axis] - at);
      if (to_border * to_border <= loosened(farthest_squared)) return true;
    }
    return false;
  }
};

// A source near the border of its part.
struct BorderPoint {
  PowerPoint point;
  std::size_t part = 0;
  NearestNeighbours neighbours{};
};

class PartedPoints {
 public:
  PartedPoints(std::uint64_t memory_bytes, std::string beside)
      : max_points_(std::max<std::uint64_t>(memory_bytes, 10'000'000) * 6 / 10 / kPointBytes),
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
    at_once_ =
        std::clamp<std::uint64_t>(kMostParts / parts, 1, static_cast<std::uint64_t>(team_size()));
    max_points_ /= at_once_;
    split(std::move(sample), {-kFar, -kFar, -kFar}, {kFar, kFar, kFar});
  }

  Result<void> add(const PowerPoint& point) {
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
      team_for(0, count, [&](std::size_t i) {
        const auto points = read(first + i);
        if (!points.ok())
          near_border[i] = points.error();
        else if (points->size() > 0)
          near_border[i] = find_inside(first + i, *points, radii);
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
  static constexpr std::uint64_t kPointBytes = 66;  // while a part is sorted
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
    const float value = emptiest_border(sample, axis);
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

  // Where to split a sample of different coordinates: near the median, at the coordinate that the
  // fewest points are close to. A wall or a floor must not lie in the border.
  static float emptiest_border(std::span<const Vec3f> sample, int axis) {
    std::vector<float> at;
    for (const Vec3f& place : sample) at.push_back(place[axis]);
    std::sort(at.begin(), at.end());
    constexpr std::size_t kTried = 64;
    const float close = (at.back() - at.front()) / 256;
    float best = std::nextafter(at.front(), at.back());
    std::size_t fewest = at.size();
    for (std::size_t i = 0; i < kTried; ++i) {
      // The quantiles between a quarter and three quarters, those next to the median first.
      const std::size_t from_middle = at.size() / 4 * (i / 2) / (kTried / 2);
      const std::size_t middle = at.size() / 2,
                        k = i % 2 == 0 ? middle + from_middle : middle - from_middle;
      const float value = at[k] / 2 + at[k - 1] / 2;
      if (!(value > at.front())) continue;
      const auto near = std::upper_bound(at.begin(), at.end(), value + close) -
                        std::lower_bound(at.begin(), at.end(), value - close);
      if (static_cast<std::size_t>(near) >= fewest) continue;
      fewest = static_cast<std::size_t>(near);
      best = value;
    }
    return best;
  }

  static Result<void> flush(RadiusPart& part) {
    const auto written = part.file.append(std::as_bytes(std::span(part.buffer)));
    part.buffer.clear();
    return written;
  }

  Result<PointRuns> read(std::size_t part) const {
    std::vector<PowerPoint> points(parts_[part].count);
    if (const auto done = parts_[part].file.read(0, std::as_writable_bytes(std::span(points)));
        !done.ok())
      return done.error();
    return PointRuns(points);
  }

  // Sets the radii of the points whose neighbours are in this part, and returns the others.
  std::vector<BorderPoint> find_inside(std::size_t p, const PointRuns& points,
                                       std::span<float> radii) const {
    const auto found = find_patch_radii(points);
    std::vector<BorderPoint> border;
    for (std::size_t i = 0; i < points.size(); ++i) {
      const PowerPoint point = points.point(i);
      if (!parts_[p].is_left(point.position_m, found[i].farthest_squared))
        radii[point.index] = found[i].radius_m;
      else
        border.push_back({point, p, NearestNeighbours(found[i].farthest_squared)});
    }
    team_for(0, border.size(), 64,
             [&](std::size_t i) { points.find(border[i].point.position_m, border[i].neighbours); });
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
      team_for(0, border_.size(), 64, [&](std::size_t i) {
        if (reaches(border_[i])) points->find(border_[i].point.position_m, border_[i].neighbours);
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

Result<std::span<const float>> patch_radii_on_disk(const ForEachSource& for_each,
                                                   const ForEachSource& for_some,
                                                   std::uint64_t count, std::uint64_t memory_bytes,
                                                   const std::string& beside, ScratchFile& radii) {
  constexpr std::size_t kSample = 100'000;
  const auto mapped = radii.map(count * sizeof(float));
  if (!mapped.ok()) return mapped.error();
  const std::span<float> values(reinterpret_cast<float*>(mapped->data()), count);
  if (count == 0) return std::span<const float>();
  // Each time the sample has twice as many places as are wanted, every second one remains.
  std::vector<Vec3f> sample;
  std::uint64_t seen = 0, stride = 1;
  const auto sampled = for_some([&](std::span<Source> sources) -> Result<void> {
    for (const Source& source : sources) {
      if (seen++ % stride == 0) sample.push_back(source.position_m);
      if (sample.size() < 2 * kSample) continue;
      for (std::size_t i = 0; i < kSample; ++i) sample[i] = sample[2 * i];
      sample.resize(kSample);
      stride *= 2;
    }
    return {};
  });
  if (!sampled.ok()) return sampled.error();
  PartedPoints parts(memory_bytes, beside);
  parts.divide(std::move(sample), count);
  std::uint32_t index = 0;
  const auto added = for_each([&](std::span<Source> sources) -> Result<void> {
    for (const Source& source : sources)
      if (const auto one = parts.add(power_point(source, index++)); !one.ok()) return one;
    return {};
  });
  if (!added.ok()) return added.error();
  if (const auto found = parts.find_radii(values); !found.ok()) return found.error();
  return std::span<const float>(values);
}

}  // namespace clamor
