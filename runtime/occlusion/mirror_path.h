// mirror_path.h: the path by which mirrors reflect sound from one place to another.
//
// From a place towards an image, the first surface is the last mirror of the path, if there is a
// path. The path continues to the image's own image in that mirror, and so back to the source. The
// walk finds the mirrors: the same image behind a corner may be heard by different orders of
// reflection in two places.
//
// Where the planes of the mirrors are known, the path is reflected by these, whatever surfaces they
// have: the borders of the mirrors are left to mirror_edges.h.
//
// Threads: any.   Cost: a ray per reflection, and one more.
#pragma once

#include <cstdint>
#include <optional>
#include <span>

#include "common/bands.h"
#include "common/vec.h"
#include "runtime/occlusion/mirror_plane.h"
#include "runtime/occlusion/occlusion_geometry.h"

namespace clamor {

// The end of a path, and its image in the mirrors on the way: with this in its place, the path is
// straight. Without mirrors, both are the same.
struct PathEnd {
  PathEnd(const Vec3& place_m) : seen_m(place_m), real_m(place_m) {}
  PathEnd(const Vec3& image_m, const Vec3& place_m, bool part_reflects = false)
      : seen_m(image_m), real_m(place_m), is_in_part(part_reflects) {}
  PathEnd(const Vec3& image_m, const Vec3& place_m, std::span<const MirrorPlane> by_planes)
      : seen_m(image_m), real_m(place_m), planes(by_planes) {}

  bool is_image() const { return seen_m != real_m; }

  Vec3 seen_m, real_m;
  bool is_in_part = false;  // the mirror is a movable part, not a surface of the level
  std::span<const MirrorPlane> planes{};  // on the way to the end, if they are known
};

struct MirrorPath {
  Bands reflected = same_in_all_bands(1);  // share of the power
  int order = 0;                           // reflections
};

// The path from a place to an end; nothing if no path leads there. Adds the rays cast to `rays`.
// The mirrors that a path to an image meets are added to `mirrors`, in the order from the image.
std::optional<MirrorPath> mirror_path(const OcclusionGeometry& geometry, const Vec3& from_m,
                                      const PathEnd& end, std::uint64_t& rays,
                                      MirrorSeries* mirrors = nullptr);

}  // namespace clamor
