// bake_root_images.h: the image sources in the root of a bake file.
//
// Internal to the files that read and write the root.
#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "common/result.h"
#include "formats/bake_file/bake_root.capnp.h"
#include "formats/bake_file/image_source.h"

namespace clamor {

inline constexpr std::size_t kMaxImages = 1 << 20;  // of a file

// `emitters`: their number in the file. The Error is a clause.
Result<std::vector<ImageSource>> read_images(BakeRoot::Reader root, std::size_t emitters);

void write_images(BakeRoot::Builder root, std::span<const ImageSource> images);

// Checks positions, axes and emitters. The Error is a clause.
Result<void> check_images(std::span<const ImageSource> images, std::size_t emitters);

}  // namespace clamor
