#include "runtime/occlusion/occlusion_geometry.h"

#include <algorithm>
#include <array>
#include <cassert>
#include <chrono>
#include <cmath>
#include <exception>

#include "formats/level/embree_mesh.h"
#include "runtime/realtime/thread_cpu_usage.h"

namespace clamor {

namespace {

// Length of the ray, back along the sound's arrival, that finds a source's side of nearby walls.
constexpr double kSideTest_m = 0.25;
// A source nearer to another wall than this may be on either side: rounding moves the source by up
// to 3.4 mm and the wall by up to 0.9 mm.
constexpr float kAmbiguous_m = 0.0045f;
constexpr int kMaxCrossings = 32;          // a path through more surfaces is silent
constexpr float kRestartFraction = 1e-5f;  // of a segment, added after a hit to leave the surface

OccluderPlane plane_of(const Mesh& mesh, const std::array<std::uint32_t, 3>& corners) {
  const Vec3 a = mesh.vertices_m[corners[0]];
  const Vec3 across =
      cross(Vec3(mesh.vertices_m[corners[1]]) - a, Vec3(mesh.vertices_m[corners[2]]) - a);
  const double twice_area = length(across);
  if (!(twice_area > 0)) return {};
  const Vec3 normal = across / twice_area;
  return {Vec3f(normal), static_cast<float>(dot(normal, a))};
}

}  // namespace

std::unique_ptr<EmbreeMesh> OcclusionGeometry::build_bvh(const Mesh& mesh, BuildQuality quality) {
  // Robust mode keeps rays from slipping through the edge between two triangles.
  EmbreeMesh::Options options{.robust = true};
  if (quality == BuildQuality::kFast)
    options.quality = options.geometry_quality = RTC_BUILD_QUALITY_LOW;
  options.alone = quality == BuildQuality::kHighAlone;
  auto bvh = std::make_unique<EmbreeMesh>(mesh, options);
  bvh->build();
  return bvh;
}

OcclusionGeometry::OcclusionGeometry(const Mesh& mesh, std::span<const Material> materials,
                                     BuildQuality quality)
    : materials_(mesh.materials) {
  for (const Material& material : materials) {
    assert(conserves_energy(material));
    transmission_.push_back(material.transmission);
    for (const float share : material.transmission) transmits_ |= share > 0;
  }
  if (mesh.triangles.empty()) return;  // free field
  planes_.reserve(mesh.triangles.size());
  for (const auto& triangle : mesh.triangles) planes_.push_back(plane_of(mesh, triangle));
  embree_ = build_bvh(mesh, quality);
  if (quality == BuildQuality::kFast) mesh_to_improve_ = &mesh;
}

bool OcclusionGeometry::improve() {
  if (mesh_to_improve_ == nullptr) return true;
  if (!better_.valid())
    better_ =
        std::async(std::launch::async, [mesh = mesh_to_improve_]() -> std::unique_ptr<EmbreeMesh> {
          name_thread("occlusion bvh");
          try {
            return build_bvh(*mesh, BuildQuality::kHigh);
          } catch (const std::exception&) {
            return nullptr;
          }
        });
  if (better_.wait_for(std::chrono::seconds(0)) != std::future_status::ready) return false;
  // If memory for the better BVH ran out, the first one stays.
  if (auto better = better_.get()) embree_ = std::move(better);
  mesh_to_improve_ = nullptr;
  return true;
}

OcclusionGeometry::~OcclusionGeometry() = default;

std::uint32_t OcclusionGeometry::first_triangle(const Vec3f& from_m, const Vec3f& to_m,
                                                float& near) const {
  const RTCRayHit ray = embree_->first_hit(from_m, to_m - from_m, near, 1);
  near = ray.ray.tfar;
  return ray.hit.geomID == RTC_INVALID_GEOMETRY_ID ? kNone : ray.hit.primID;
}

const OccluderPlane* OcclusionGeometry::first_surface(const Vec3f& from_m,
                                                      const Vec3f& to_m) const {
  if (empty()) return nullptr;
  float near = 0;
  const std::uint32_t triangle = first_triangle(from_m, to_m, near);
  return triangle == kNone ? nullptr : &planes_[triangle];
}

void OcclusionGeometry::first_surfaces(
    std::span<const PathSegment, kPacketRays> segments, std::uint32_t lanes,
    std::span<const OccluderPlane*, kPacketRays> surfaces) const {
  alignas(64) std::array<int, kPacketRays> valid{};
  alignas(64) RTCRayHit16 rays;
  for (std::size_t l = 0; l < kPacketRays; ++l) {
    surfaces[l] = nullptr;
    valid[l] = (lanes >> l & 1) != 0 ? -1 : 0;
    const PathSegment& segment = segments[l];
    rays.ray.org_x[l] = segment.from_m.x;
    rays.ray.org_y[l] = segment.from_m.y;
    rays.ray.org_z[l] = segment.from_m.z;
    rays.ray.tnear[l] = 0;
    rays.ray.dir_x[l] = segment.to_m.x - segment.from_m.x;
    rays.ray.dir_y[l] = segment.to_m.y - segment.from_m.y;
    rays.ray.dir_z[l] = segment.to_m.z - segment.from_m.z;
    rays.ray.time[l] = 0;
    rays.ray.tfar[l] = 1;
    rays.ray.mask[l] = 0xffffffff;
    rays.ray.id[l] = 0;
    rays.ray.flags[l] = 0;
    rays.hit.geomID[l] = rays.hit.primID[l] = rays.hit.instID[0][l] = RTC_INVALID_GEOMETRY_ID;
  }
  if (empty()) return;
  embree_->first_hits(valid.data(), rays);
  for (std::size_t l = 0; l < kPacketRays; ++l)
    if (valid[l] != 0 && rays.hit.geomID[l] != RTC_INVALID_GEOMETRY_ID)
      surfaces[l] = &planes_[rays.hit.primID[l]];
}

bool OcclusionGeometry::is_free(const Vec3f& from_m, const Vec3f& to_m) const {
  return empty() || !embree_->is_occluded(from_m, to_m);
}

Bands OcclusionGeometry::transmission(const Vec3f& from_m, const Vec3f& to_m,
                                      std::uint64_t& rays) const {
  Bands through = same_in_all_bands(1);
  if (empty()) return through;
  float near = 0;
  std::uint32_t last = kNone;
  for (int crossing = 0; crossing < kMaxCrossings; ++crossing) {
    ++rays;
    const std::uint32_t triangle = first_triangle(from_m, to_m, near);
    if (triangle == kNone) return through;
    if (!transmits_) return Bands{};
    near += kRestartFraction;
    if (triangle == last) continue;
    last = triangle;
    float strongest = 0;
    for (std::size_t b = 0; b < kBandCount; ++b) {
      through[b] *= transmission_[materials_[triangle]][b];
      strongest = std::max(strongest, through[b]);
    }
    if (strongest == 0) return through;
  }
  return Bands{};
}

std::optional<Vec3f> OcclusionGeometry::ray_origin(const Source& source) const {
  const Vec3f position_m = source.position_m;
  if (source.is_emitter || empty()) return position_m;
  const auto offset_m = static_cast<float>(kStartOffset_m);
  const Vec3f origin_m = position_m + offset_m * source.normal;
  const Vec3f back = 2 * glm::dot(source.mirror, source.normal) * source.normal - source.mirror;
  const OccluderPlane* const wall =
      first_surface(origin_m, origin_m + static_cast<float>(kSideTest_m) * back);
  if (wall != nullptr && std::abs(wall->height_m(origin_m)) < kAmbiguous_m) return std::nullopt;
  return origin_m;
}

}  // namespace clamor
