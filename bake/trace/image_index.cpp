#include "bake/trace/image_index.h"

#include <cmath>
#include <cstddef>

#include "common/fibonacci_hash.h"

namespace clamor {

namespace {

constexpr double kCell_m = 0.5;

std::uint64_t cell_key(std::uint32_t emitter, std::int64_t x, std::int64_t y, std::int64_t z) {
  std::uint64_t key = emitter;
  for (const std::int64_t part : {x, y, z})
    key = fibonacci_hash(key ^ static_cast<std::uint64_t>(part));
  return key;
}

std::int64_t cell_of(double place_m) {
  return static_cast<std::int64_t>(std::floor(place_m / kCell_m));
}

}  // namespace

ImageIndex::ImageIndex(std::span<const ImageSource> images) {
  for (const ImageSource& image : images) add(image, 0);
}

std::ptrdiff_t ImageIndex::find(std::uint32_t emitter, const Vec3& image_m, double path_m) const {
  const double within_m = image_tolerance_m(path_m);
  for (auto x = cell_of(image_m.x - within_m); x <= cell_of(image_m.x + within_m); ++x)
    for (auto y = cell_of(image_m.y - within_m); y <= cell_of(image_m.y + within_m); ++y)
      for (auto z = cell_of(image_m.z - within_m); z <= cell_of(image_m.z + within_m); ++z) {
        const auto [first, last] = by_cell_.equal_range(cell_key(emitter, x, y, z));
        for (auto one = first; one != last; ++one) {
          const ImageSource& image = images_[one->second];
          if (image.emitter == emitter && length(image.position_m - image_m) <= within_m)
            return one->second;
        }
      }
  return -1;
}

std::size_t ImageIndex::add(const ImageSource& image, double path_m) {
  if (const auto known = find(image.emitter, image.position_m, path_m); known >= 0)
    return static_cast<std::size_t>(known);
  const Vec3& at_m = image.position_m;
  by_cell_.emplace(cell_key(image.emitter, cell_of(at_m.x), cell_of(at_m.y), cell_of(at_m.z)),
                   static_cast<std::uint32_t>(images_.size()));
  images_.push_back(image);
  return images_.size() - 1;
}

}  // namespace clamor
