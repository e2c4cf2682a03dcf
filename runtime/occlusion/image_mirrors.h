// image_mirrors.h: the planes that the images of a level are reflected by, one after the other.
//
// A bake file has an emitter's images without their mirrors. An image of two reflections is the
// mirror image of one with one reflection, which is in the list as well, since each ray that found
// the first has found the second (bake/early/image_search.h). So the planes half way between two
// images are the candidates, and those that hold a surface of the level are mirrors. In a corner,
// an image comes about in several ways: those with the fewest reflections count.
//
// Threads: any; nothing changes after the constructor.
// Memory: 100 bytes for each way to an image.
// Cost: building takes 2 to 5 ms for an emitter with 512 images.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "common/flat_hash_map.h"
#include "common/vec.h"
#include "formats/bake_file/image_source.h"
#include "formats/bake_file/source.h"
#include "runtime/occlusion/mirror_plane.h"
#include "runtime/occlusion/occluder_plane.h"

namespace clamor {

// Planes in the order in which they reflect, with normals to the side of the path.
struct MirrorSeries {
  void add_before(const MirrorPlane& plane) {
    std::shift_right(planes.begin(), planes.end(), 1);
    planes[0] = plane;
    ++order;
  }

  std::array<MirrorPlane, kMaxImageOrder> planes{};
  std::size_t order = 0;
};

class ImageMirrors {
 public:
  ImageMirrors() = default;
  // Sources that are no images are left out.
  ImageMirrors(std::span<const OccluderPlane> surfaces, std::span<const Source> sources);

  // All series that lead to an image; none if it is unknown, or one of more than 4096 of an
  // emitter.
  std::span<const MirrorSeries> of(const Vec3f& image_m, const Vec3f& original_m) const;

 private:
  struct Range {
    std::uint32_t first = 0, count = 0;
  };

  std::vector<MirrorSeries> series_;
  FlatHashMap<Range> by_image_;
};

}  // namespace clamor
