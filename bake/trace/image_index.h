// image_index.h: whether a specular path is one of those that image sources stand for.
//
// Images are found in a grid. The tolerance of a search grows with the path, and so do the cells: a
// grid for each octave of the tolerance holds all images, as far up as paths or images reach.
// Levels of up to a hundred metres have one grid.
//
// Threads: immutable, so any.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <unordered_map>
#include <vector>

#include "common/bounds.h"
#include "formats/bake_file/image_source.h"

namespace clamor {

class ImageIndex {
 public:
  ImageIndex() = default;
  explicit ImageIndex(std::span<const ImageSource> images);

  std::span<const ImageSource> images() const { return images_; }

  // Whether sound of an emitter that has travelled this far, and seems to come from `image_m`, is
  // that of one of the images. Looks into 27 cells at most, which it counts in `visits` unless that
  // is null. Only for an index that was made of all its images.
  bool contains(std::uint32_t emitter, const Vec3& image_m, double path_m,
                std::size_t* visits = nullptr) const {
    return find(emitter, image_m, path_m, visits) >= 0;
  }

  // Adds an image unless that is there already. Returns its index.
  std::size_t add(const ImageSource& image, double path_m);

 private:
  // The index of the image, or -1.
  std::ptrdiff_t find(std::uint32_t emitter, const Vec3& image_m, double path_m,
                      std::size_t* visits = nullptr) const;
  void add_to_grid(std::size_t index, int octave);
  void add_octave();

  std::vector<ImageSource> images_;
  Bounds bounds_;  // of the images
  int octaves_ = 1;
  std::unordered_multimap<std::uint64_t, std::uint32_t> by_cell_;
};

}  // namespace clamor
