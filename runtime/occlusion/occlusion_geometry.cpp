#include "runtime/occlusion/occlusion_geometry.h"

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <utility>

#include "formats/level/embree_mesh.h"
#include "runtime/occlusion/image_mirrors.h"
#include "runtime/occlusion/packet_rays.h"
#include "runtime/occlusion/part_scene.h"

namespace clamor {

namespace {

// Length of the ray, back along the sound's arrival, that finds a source's side of nearby walls.
constexpr double kSideTest_m = 0.25;
// A source nearer to another wall than this may be on either side: rounding moves the source by up
// to 3.4 mm and the wall by up to 0.9 mm.
constexpr float kAmbiguous_m = 0.0045f;
constexpr int kMaxCrossings = 32;          // a path through more surfaces is silent
constexpr float kRestartFraction = 1e-5f;  // of a segment, added after a hit to leave the surface

// Where a segment crosses a plane. Embree's own fraction has the processor's approximate
// reciprocal, which AMD and Intel round apart.
float crossing(const OccluderPlane& plane, const Vec3f& from_m, const Vec3f& to_m) {
  const Vec3 normal(plane.normal), from(from_m);
  const double falling = dot(normal, from - Vec3(to_m));
  if (falling == 0) return 0;
  const double height_m = dot(normal, from) - static_cast<double>(plane.offset_m);
  return static_cast<float>(std::clamp(height_m / falling, 0.0, 1.0));
}

}  // namespace

OcclusionGeometry::OcclusionGeometry(std::shared_ptr<LevelSurfaces> level,
                                     std::span<const Material> materials, BvhQuality quality)
    : level_(std::move(level)),
      embree_(level_->bvh(quality)),
      improves_(quality == BvhQuality::kFast && embree_ != nullptr) {
  for (const Material& material : materials) {
    assert(conserves_energy(material));
    transmission_.push_back(material.transmission);
    mirrored_.push_back(clamor::mirror_reflection(material));
    for (const float share : material.transmission) transmits_ |= share > 0;
    if (has_seat_rows(material)) rows_.assign(materials.begin(), materials.end());
  }
}

bool OcclusionGeometry::improve() {
  if (!improves_) return true;
  const auto better = level_->better_bvh();
  if (!better.has_value()) return false;
  // If memory for the better BVH ran out, the first one stays.
  if (*better != nullptr) embree_ = *better;
  improves_ = false;
  return true;
}

bool OcclusionGeometry::has_parts() const { return parts_ != nullptr && !parts_->empty(); }

std::uint64_t OcclusionGeometry::parts_version() const {
  return parts_ == nullptr ? 0 : parts_->version();
}

bool OcclusionGeometry::parts_transmit() const { return parts_ != nullptr && parts_->transmits(); }

bool OcclusionGeometry::transmits() const { return transmits_ || parts_transmit(); }

std::uint32_t OcclusionGeometry::first_triangle(const Vec3f& from_m, const Vec3f& to_m,
                                                float& near) const {
  if (embree_ == nullptr) {
    near = 1;
    return kNone;
  }
  const RTCRayHit ray = embree_->first_hit(from_m, to_m - from_m, near, 1);
  const bool is_hit = ray.hit.geomID != RTC_INVALID_GEOMETRY_ID;
  near = is_hit ? crossing(level_->planes()[ray.hit.primID], from_m, to_m) : 1;
  return is_hit ? ray.hit.primID : kNone;
}

// The first surface of the mesh.
std::optional<OccluderPlane> OcclusionGeometry::first_wall(const Vec3f& from_m,
                                                           const Vec3f& to_m) const {
  float near = 0;
  const std::uint32_t triangle = first_triangle(from_m, to_m, near);
  return triangle == kNone ? std::nullopt : std::optional(level_->planes()[triangle]);
}

std::optional<OccluderPlane> OcclusionGeometry::first_surface(const Vec3f& from_m,
                                                              const Vec3f& to_m) const {
  float near = 0;
  const std::uint32_t triangle = first_triangle(from_m, to_m, near);
  if (has_parts())
    if (const auto hit = parts_->first_hit(from_m, to_m, 0, near)) return parts_->plane(*hit);
  return triangle == kNone ? std::nullopt : std::optional(level_->planes()[triangle]);
}

std::optional<OcclusionGeometry::LevelHit> OcclusionGeometry::first_level_hit(
    const Vec3f& from_m, const Vec3f& to_m) const {
  float near = 0;
  const std::uint32_t triangle = first_triangle(from_m, to_m, near);
  if (triangle == kNone) return std::nullopt;
  if (has_parts() && parts_->first_hit(from_m, to_m, 0, near)) return std::nullopt;
  return LevelHit{near, level_->planes()[triangle].normal, level_->mesh().materials[triangle]};
}

std::optional<OcclusionGeometry::SurfaceHit> OcclusionGeometry::first_hit(const Vec3f& from_m,
                                                                          const Vec3f& to_m) const {
  float near = 0;
  const std::uint32_t triangle = first_triangle(from_m, to_m, near);
  if (has_parts())
    if (const auto hit = parts_->first_hit(from_m, to_m, 0, near))
      return SurfaceHit{hit->fraction, parts_->plane(*hit).normal, &parts_->mirrored(*hit),
                        hit->part};
  if (triangle == kNone) return std::nullopt;
  return SurfaceHit{near, level_->planes()[triangle].normal,
                    &mirrored_[level_->mesh().materials[triangle]]};
}

void OcclusionGeometry::first_surfaces(
    std::span<const PathSegment, kPacketRays> segments, std::uint32_t lanes,
    std::span<std::optional<OccluderPlane>, kPacketRays> surfaces) const {
  std::ranges::fill(surfaces, std::nullopt);
  std::array<float, kPacketRays> fractions;
  fractions.fill(1);
  if (embree_ != nullptr) {
    PacketRays packet(segments, lanes);
    embree_->first_hits(packet.valid.data(), packet.rays);
    for (std::size_t l = 0; l < kPacketRays; ++l) {
      if (!packet.has_hit(l)) continue;
      surfaces[l] = level_->planes()[packet.rays.hit.primID[l]];
      fractions[l] = packet.rays.ray.tfar[l];
    }
  }
  if (has_parts()) parts_->first_hits(segments, lanes, fractions, surfaces);
}

void OcclusionGeometry::find_edges(const Vec3& from_m, const Vec3& to_m, std::size_t count,
                                   double longest_m, std::vector<EdgeBetween>& found) const {
  level_->edges().find_nearest(from_m, to_m, count, longest_m, found);
  if (has_parts()) parts_->find_edges(from_m, to_m, count, longest_m, found);
}

void OcclusionGeometry::find_edges_in(const MirrorPlane& plane, const Vec3& from_m,
                                      const Vec3& to_m, std::size_t count, double longest_m,
                                      std::vector<EdgeBetween>& found) const {
  level_->edges().find_nearest(from_m, to_m, count, longest_m, found, &plane);
}

std::span<const MirrorSeries> OcclusionGeometry::mirrors_of(const Vec3f& image_m,
                                                            const Vec3f& original_m) const {
  return level_->mirrors_of(image_m, original_m);
}

bool OcclusionGeometry::is_free(const Vec3f& from_m, const Vec3f& to_m) const {
  return (embree_ == nullptr || !embree_->is_occluded(from_m, to_m)) &&
         (!has_parts() || parts_->is_free(from_m, to_m));
}

Bands OcclusionGeometry::transmission(const Vec3f& from_m, const Vec3f& to_m,
                                      std::uint64_t& rays) const {
  return transmission(from_m, to_m, rays, false);
}

Bands OcclusionGeometry::transmission_of_parts(const Vec3f& from_m, const Vec3f& to_m,
                                               std::uint64_t& rays) const {
  ++rays;
  if (!has_parts() || parts_->is_free(from_m, to_m)) return Bands{};
  ++rays;
  if (embree_ != nullptr && embree_->is_occluded(from_m, to_m)) return Bands{};
  return transmission(from_m, to_m, rays, true);
}

Bands OcclusionGeometry::transmission(const Vec3f& from_m, const Vec3f& to_m, std::uint64_t& rays,
                                      bool parts_only) const {
  Bands through = same_in_all_bands(1);
  if (empty()) return through;
  float near = 0;
  std::uint32_t last = kNone;
  constexpr PartScene::Hit kNoPart{0, kNone, kNone};
  PartScene::Hit last_part = kNoPart;
  for (int crossing = 0; crossing < kMaxCrossings; ++crossing) {
    ++rays;
    float hit = near;
    const std::uint32_t triangle = parts_only ? kNone : first_triangle(from_m, to_m, hit);
    if (parts_only) hit = 1;
    PartScene::Hit part = kNoPart;
    if (has_parts())
      if (const auto found = parts_->first_hit(from_m, to_m, near, hit)) part = *found;
    const bool is_part = part.part != kNone;
    if (triangle == kNone && !is_part) return through;
    if (!transmits()) return Bands{};
    near = (is_part ? part.fraction : hit) + kRestartFraction;
    const bool again = is_part ? last_part.part == part.part && last_part.triangle == part.triangle
                               : triangle == last;
    last = is_part ? kNone : triangle;
    last_part = part;
    if (again) continue;
    const Bands& transmitted =
        is_part ? parts_->transmission(part) : transmission_[level_->mesh().materials[triangle]];
    float strongest = 0;
    for (std::size_t b = 0; b < kBandCount; ++b) {
      through[b] *= transmitted[b];
      strongest = std::max(strongest, through[b]);
    }
    if (strongest == 0) return through;
  }
  return Bands{};
}

std::optional<Vec3f> OcclusionGeometry::ray_origin(const Source& source) const {
  const Vec3f position_m = source.position_m;
  if (source.is_emitter || embree_ == nullptr) return position_m;
  const auto offset_m = static_cast<float>(kStartOffset_m);
  const Vec3f origin_m = position_m + offset_m * source.normal;
  const Vec3f back = 2 * glm::dot(source.mirror, source.normal) * source.normal - source.mirror;
  const auto wall = first_wall(origin_m, origin_m + static_cast<float>(kSideTest_m) * back);
  if (wall && std::abs(wall->height_m(origin_m)) < kAmbiguous_m) return std::nullopt;
  return origin_m;
}

}  // namespace clamor
