// mirror_images.h: image sources for tests of paths that mirrors reflect.
#pragma once

#include <vector>

#include "formats/bake_file/source.h"
#include "runtime/occlusion/mirror_plane.h"

namespace clamor::testing {

// The images of a source in planes, one after the other, as a bake file has them.
inline std::vector<Source> images_by(const std::vector<MirrorPlane>& planes, const Vec3& source_m) {
  std::vector<Source> images;
  Vec3 image_m = source_m, axis(0.6, 0, -0.8);
  for (const MirrorPlane& plane : planes) {
    image_m = plane.image_of(image_m);
    axis = plane.mirrored(axis);
    Source& image = images.emplace_back();
    image.is_emitter = image.is_image = true;
    image.position_m = Vec3f(image_m);
    image.normal = Vec3f(axis);
    image.original_m = Vec3f(source_m);
  }
  return images;
}

}  // namespace clamor::testing
