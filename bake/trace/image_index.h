// image_index.h: whether a specular path is one of those that image sources stand for.
//
// Threads: immutable, so any.
#pragma once

#include <cstdint>
#include <span>
#include <unordered_map>
#include <vector>

#include "formats/bake_file/image_source.h"

namespace clamor {

class ImageIndex {
 public:
  ImageIndex() = default;
  explicit ImageIndex(std::span<const ImageSource> images);

  std::span<const ImageSource> images() const { return images_; }

  // Whether sound of an emitter that has travelled this far, and seems to come from `image_m`, is
  // that of one of the images.
  bool contains(std::uint32_t emitter, const Vec3& image_m, double path_m) const {
    return find(emitter, image_m, path_m) >= 0;
  }
  // The index of the image, or -1.
  std::ptrdiff_t find(std::uint32_t emitter, const Vec3& image_m, double path_m) const;

  // Adds an image unless that is there already. Returns its index.
  std::size_t add(const ImageSource& image, double path_m);

 private:
  std::vector<ImageSource> images_;
  std::unordered_multimap<std::uint64_t, std::uint32_t> by_cell_;
};

}  // namespace clamor
