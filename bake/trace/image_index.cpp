#include "bake/trace/image_index.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "common/fibonacci_hash.h"

namespace clamor {

namespace {

// Cells of an octave are at least as wide as the tolerances that it serves.
double cell_m(int octave) { return std::ldexp(0.5, octave); }

int octave_of(double tolerance_m) {
  int octave = 0;
  while (cell_m(octave) < tolerance_m) ++octave;
  return octave;
}

using Cell = std::array<std::int64_t, 3>;

Cell cell_of(const Vec3& place_m, int octave) {
  Cell cell;
  for (int axis = 0; axis < 3; ++axis)
    cell[static_cast<std::size_t>(axis)] =
        static_cast<std::int64_t>(std::floor(place_m[axis] / cell_m(octave)));
  return cell;
}

std::uint64_t cell_key(std::uint32_t emitter, int octave, const Cell& cell) {
  std::uint64_t key = emitter | static_cast<std::uint64_t>(octave) << 32;
  for (const std::int64_t part : cell) key = fibonacci_hash(key ^ static_cast<std::uint64_t>(part));
  return key;
}

}  // namespace

ImageIndex::ImageIndex(std::span<const ImageSource> images) {
  for (const ImageSource& image : images) add(image, 0);
  while (!images_.empty() && cell_m(octaves_ - 1) < bounds_.diagonal_m()) add_octave();
}

std::ptrdiff_t ImageIndex::find(std::uint32_t emitter, const Vec3& image_m, double path_m,
                                std::size_t* visits) const {
  if (images_.empty()) return -1;
  const double within_m = image_tolerance_m(path_m);
  const int octave = std::min(octave_of(within_m), octaves_ - 1);
  // Cells beyond all images are empty.
  const Cell low = cell_of(glm::max(image_m - within_m, bounds_.low_m), octave),
             high = cell_of(glm::min(image_m + within_m, bounds_.high_m), octave);
  for (auto x = low[0]; x <= high[0]; ++x)
    for (auto y = low[1]; y <= high[1]; ++y)
      for (auto z = low[2]; z <= high[2]; ++z) {
        if (visits != nullptr) ++*visits;
        const auto [first, last] = by_cell_.equal_range(cell_key(emitter, octave, {x, y, z}));
        for (auto one = first; one != last; ++one) {
          const ImageSource& image = images_[one->second];
          if (image.emitter == emitter && length(image.position_m - image_m) <= within_m)
            return one->second;
        }
      }
  return -1;
}

std::size_t ImageIndex::add(const ImageSource& image, double path_m) {
  while (octaves_ <= octave_of(image_tolerance_m(path_m))) add_octave();
  if (const auto known = find(image.emitter, image.position_m, path_m); known >= 0)
    return static_cast<std::size_t>(known);
  images_.push_back(image);
  bounds_.add(image.position_m);
  for (int octave = 0; octave < octaves_; ++octave) add_to_grid(images_.size() - 1, octave);
  return images_.size() - 1;
}

void ImageIndex::add_to_grid(std::size_t index, int octave) {
  const ImageSource& image = images_[index];
  by_cell_.emplace(cell_key(image.emitter, octave, cell_of(image.position_m, octave)),
                   static_cast<std::uint32_t>(index));
}

void ImageIndex::add_octave() {
  for (std::size_t i = 0; i < images_.size(); ++i) add_to_grid(i, octaves_);
  ++octaves_;
}

}  // namespace clamor
