#include "runtime/occlusion/image_mirrors.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <initializer_list>
#include <map>
#include <tuple>

#include "common/fibonacci_hash.h"

namespace clamor {

namespace {

// Planes within half a step of each other are the same.
constexpr double kNormalStep = 1.0 / 32, kOffsetStep_m = 0.125;
constexpr double kSameAxis = 0.01;  // difference of unit vectors
constexpr double kMinDistance_m = 0.01;
constexpr std::size_t kMaxSeries = 8;  // of one image
// The limit for one emitter: a bake finds 512, and the search takes the square of their number.
constexpr std::size_t kMaxImages = 4096;

std::uint64_t mixed(std::uint64_t key, std::int64_t part) {
  return fibonacci_hash(key ^ static_cast<std::uint64_t>(part + 1));
}

// The planes of the level's surfaces, and whether any has a normal.
class PlaneSet {
 public:
  explicit PlaneSet(std::span<const OccluderPlane> surfaces)
      : normals_(kNormals * kNormals * kNormals) {
    for (const OccluderPlane& plane : surfaces)
      for (const double sign : {1.0, -1.0}) {
        const Vec3 normal = sign * Vec3(plane.normal);
        bool& is_known =
            planes_[key(cell(normal.x), cell(normal.y), cell(normal.z),
                        std::llround(sign * static_cast<double>(plane.offset_m) / kOffsetStep_m))];
        if (is_known) break;
        is_known = true;
        for_neighbours(normal, [&](std::int64_t x, std::int64_t y, std::int64_t z) {
          normals_[index(x, y, z)] = true;
          return false;
        });
      }
  }

  bool contains(const MirrorPlane& plane) const {
    if (!normals_[index(cell(plane.normal.x), cell(plane.normal.y), cell(plane.normal.z))])
      return false;
    const auto offset = static_cast<std::int64_t>(std::floor(plane.offset_m / kOffsetStep_m));
    return for_neighbours(plane.normal, [&](std::int64_t x, std::int64_t y, std::int64_t z) {
      return planes_.find(key(x, y, z, offset)) != nullptr ||
             planes_.find(key(x, y, z, offset + 1)) != nullptr;
    });
  }

 private:
  static constexpr std::int64_t kNormals = 67;  // cells from -1 to 1, and one beyond at either end

  static std::int64_t cell(double part) { return std::llround(part / kNormalStep); }
  static std::size_t index(std::int64_t x, std::int64_t y, std::int64_t z) {
    constexpr std::int64_t kMiddle = kNormals / 2;
    return static_cast<std::size_t>(((x + kMiddle) * kNormals + y + kMiddle) * kNormals + z +
                                    kMiddle);
  }
  static std::uint64_t key(std::int64_t x, std::int64_t y, std::int64_t z, std::int64_t offset) {
    return mixed(index(x, y, z), offset);
  }

  // Calls act(x, y, z) for the eight cells around a normal until it returns true. Returns whether
  // it has.
  template <class Act>
  static bool for_neighbours(const Vec3& normal, const Act& act) {
    const auto low = [](double part) {
      return static_cast<std::int64_t>(std::floor(part / kNormalStep));
    };
    for (const std::int64_t x : {0, 1})
      for (const std::int64_t y : {0, 1})
        for (const std::int64_t z : {0, 1})
          if (act(low(normal.x) + x, low(normal.y) + y, low(normal.z) + z)) return true;
    return false;
  }

  std::vector<bool> normals_;
  FlatHashMap<bool> planes_;
};

// A source or an image of it, and how many reflections have made it.
struct ImageNode {
  Vec3 place_m, axis;
  std::size_t order = 0;
  std::vector<MirrorSeries> series{};
};

// Finds the series of one emitter's images. The first node is the source.
void find_series(const PlaneSet& surfaces, std::vector<ImageNode>& nodes) {
  nodes[0].series.resize(1);
  std::vector<std::size_t> last{0}, found;
  for (std::size_t order = 1; order <= kMaxImageOrder && !last.empty(); ++order, last = found) {
    found.clear();
    for (std::size_t i = 1; i < nodes.size(); ++i) {
      ImageNode& image = nodes[i];
      if (!image.series.empty()) continue;
      for (const std::size_t l : last) {
        const ImageNode& before = nodes[l];
        const Vec3 to_before_m = before.place_m - image.place_m;
        const double distance2_m2 = dot(to_before_m, to_before_m);
        if (!(distance2_m2 > kMinDistance_m * kMinDistance_m)) continue;
        // The source's own axis is not known.
        const Vec3 turned = before.axis - image.axis -
                            2 * dot(before.axis, to_before_m) / distance2_m2 * to_before_m;
        if (order > 1 && dot(turned, turned) > kSameAxis * kSameAxis) continue;
        MirrorPlane plane{to_before_m / std::sqrt(distance2_m2), 0};
        plane.offset_m = dot(plane.normal, 0.5 * (before.place_m + image.place_m));
        if (!surfaces.contains(plane)) continue;
        for (const MirrorSeries& one : before.series) {
          if (image.series.size() == kMaxSeries) break;
          MirrorSeries& longer = image.series.emplace_back(one);
          longer.planes[longer.order++] = plane;
        }
      }
      if (!image.series.empty()) found.push_back(i);
    }
  }
}

std::uint64_t key_of(const Vec3f& image_m, const Vec3f& original_m) {
  std::uint64_t key = 0;
  for (const Vec3f& place_m : {image_m, original_m})
    for (const float part : {place_m.x, place_m.y, place_m.z})
      key = mixed(key, std::bit_cast<std::int32_t>(part));
  return key;
}

}  // namespace

ImageMirrors::ImageMirrors(std::span<const OccluderPlane> surfaces,
                           std::span<const Source> sources) {
  std::map<std::tuple<std::uint32_t, float, float, float>, std::vector<ImageNode>> by_emitter;
  for (const Source& source : sources) {
    if (!source.is_image || source.is_in_part) continue;
    const Vec3f& original_m = source.original_m;
    std::vector<ImageNode>& nodes =
        by_emitter[{source.emitter, original_m.x, original_m.y, original_m.z}];
    if (nodes.empty()) nodes.push_back({Vec3(original_m), Vec3(0)});
    nodes.push_back({Vec3(source.position_m), Vec3(source.normal)});
  }
  if (by_emitter.empty()) return;
  const PlaneSet planes(surfaces);
  for (auto& [emitter, nodes] : by_emitter) {
    if (nodes.size() > kMaxImages) continue;
    find_series(planes, nodes);
    for (const ImageNode& image : std::span(nodes).subspan(1)) {
      if (image.series.empty()) continue;
      by_image_[key_of(Vec3f(image.place_m), Vec3f(nodes[0].place_m))] = {
          static_cast<std::uint32_t>(series_.size()),
          static_cast<std::uint32_t>(image.series.size())};
      series_.insert(series_.end(), image.series.begin(), image.series.end());
    }
  }
}

std::span<const MirrorSeries> ImageMirrors::of(const Vec3f& image_m,
                                               const Vec3f& original_m) const {
  const Range* range = by_image_.find(key_of(image_m, original_m));
  return range == nullptr ? std::span<const MirrorSeries>()
                          : std::span(series_).subspan(range->first, range->count);
}

}  // namespace clamor
