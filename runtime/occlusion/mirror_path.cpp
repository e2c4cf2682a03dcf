#include "runtime/occlusion/mirror_path.h"

#include <algorithm>
#include <cstddef>

#include "formats/bake_file/image_source.h"
#include "runtime/occlusion/image_mirrors.h"

namespace clamor {

namespace {

std::optional<MirrorPath> path_by_planes(const OcclusionGeometry& geometry, const Vec3& from_m,
                                         const PathEnd& end, std::uint64_t& rays) {
  MirrorPath path;
  Vec3 start_m = from_m, target_m = end.seen_m;
  for (const MirrorPlane& plane : end.planes) {
    if (!(plane.height_m(start_m) > 0 && plane.height_m(target_m) < 0)) return std::nullopt;
    const Vec3 point_m =
        plane.crossing_m(start_m, target_m) + plane.normal * OcclusionGeometry::kStartOffset_m;
    ++rays;
    if (!geometry.is_free(Vec3f(start_m), Vec3f(point_m))) return std::nullopt;
    start_m = point_m;
    target_m = plane.image_of(target_m);
    ++path.order;
  }
  ++rays;
  return geometry.is_free(Vec3f(end.real_m), Vec3f(start_m)) ? std::optional(path) : std::nullopt;
}

}  // namespace

std::optional<MirrorPath> mirror_path(const OcclusionGeometry& geometry, const Vec3& from_m,
                                      const PathEnd& end, std::uint64_t& rays,
                                      MirrorSeries* mirrors) {
  if (!end.planes.empty()) return path_by_planes(geometry, from_m, end, rays);
  MirrorPath path;
  Vec3 start_m = from_m, target_m = end.seen_m;
  const double within_m = image_tolerance_m(length(target_m - from_m));
  for (;; ++path.order) {
    if (!end.is_image() || (path.order > 0 && length(target_m - end.real_m) <= within_m)) {
      ++rays;
      return geometry.is_free(Vec3f(end.real_m), Vec3f(start_m)) ? std::optional(path)
                                                                 : std::nullopt;
    }
    if (path.order == (end.is_in_part ? 1 : kMaxImageOrder)) return std::nullopt;
    ++rays;
    const auto hit = geometry.first_hit(Vec3f(start_m), Vec3f(target_m));
    if (!hit || hit->part.has_value() != end.is_in_part) return std::nullopt;
    float most = 0;
    for (std::size_t b = 0; b < kBandCount; ++b)
      most = std::max(most, path.reflected[b] *= (*hit->mirrored)[b]);
    if (!(most > 0)) return std::nullopt;
    const Vec3 point_m = start_m + (target_m - start_m) * static_cast<double>(hit->fraction);
    Vec3 normal(hit->normal);
    if (dot(start_m - point_m, normal) < 0) normal = -normal;
    if (mirrors != nullptr) mirrors->add_before({normal, dot(normal, point_m)});
    target_m += normal * (2 * dot(point_m - target_m, normal));
    start_m = point_m + normal * OcclusionGeometry::kStartOffset_m;
  }
}

}  // namespace clamor
