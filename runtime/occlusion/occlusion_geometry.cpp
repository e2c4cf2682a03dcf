#include "runtime/occlusion/occlusion_geometry.h"

#if __has_include(<embree4/rtcore.h>)
#include <embree4/rtcore.h>
#else
#include <embree3/rtcore.h>
#endif

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <exception>
#include <new>
#include <stdexcept>
#include <string>

#include "runtime/realtime/thread_cpu_usage.h"

namespace clamor {

// Owns the Embree objects of one BVH.
struct OcclusionGeometry::Embree {
  RTCDevice device = nullptr;
  RTCScene scene = nullptr;
  RTCGeometry geometry = nullptr;

  ~Embree() {
    if (geometry != nullptr) rtcReleaseGeometry(geometry);
    if (scene != nullptr) rtcReleaseScene(scene);
    if (device != nullptr) rtcReleaseDevice(device);
  }
};

namespace {

// Length of the ray, back along the sound's arrival, that finds a source's side of nearby walls.
constexpr double kSideTest_m = 0.25;
// A source nearer to another wall than this may be on either side: rounding moves the source by up
// to 3.4 mm and the wall by up to 0.9 mm.
constexpr float kAmbiguous_m = 0.0045f;
constexpr int kMaxCrossings = 32;          // a path through more surfaces is silent
constexpr float kRestartFraction = 1e-5f;  // of a segment, added after a hit to leave the surface

// Throws if an Embree call since the last check failed.
void check(RTCDevice device) {
  const RTCError error = rtcGetDeviceError(device);
  if (error == RTC_ERROR_OUT_OF_MEMORY) throw std::bad_alloc();
  if (device == nullptr || error != RTC_ERROR_NONE)
    throw std::runtime_error("Embree cannot build its tree of the level's surfaces (error " +
                             std::to_string(error) + ")");
}

RTCRay ray_between(const Vec3f& from_m, const Vec3f& to_m, float near) {
  RTCRay ray;
  ray.org_x = from_m.x;
  ray.org_y = from_m.y;
  ray.org_z = from_m.z;
  ray.tnear = near;
  ray.dir_x = to_m.x - from_m.x;
  ray.dir_y = to_m.y - from_m.y;
  ray.dir_z = to_m.z - from_m.z;
  ray.time = 0;
  ray.tfar = 1;
  ray.mask = 0xffffffff;
  ray.id = 0;
  ray.flags = 0;
  return ray;
}

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

std::unique_ptr<OcclusionGeometry::Embree> OcclusionGeometry::build_bvh(const Mesh& mesh,
                                                                        BuildQuality quality) {
  auto tree = std::make_unique<Embree>();
  tree->device = rtcNewDevice(nullptr);
  check(tree->device);
  tree->scene = rtcNewScene(tree->device);
  check(tree->device);
  rtcSetSceneBuildQuality(
      tree->scene, quality == BuildQuality::kFast ? RTC_BUILD_QUALITY_LOW : RTC_BUILD_QUALITY_HIGH);
  // Robust mode keeps rays from slipping through the edge between two triangles.
  rtcSetSceneFlags(tree->scene, RTC_SCENE_FLAG_ROBUST);
  tree->geometry = rtcNewGeometry(tree->device, RTC_GEOMETRY_TYPE_TRIANGLE);
  check(tree->device);
  if (quality == BuildQuality::kFast)
    rtcSetGeometryBuildQuality(tree->geometry, RTC_BUILD_QUALITY_LOW);
  auto* vertices = static_cast<Vec3f*>(
      rtcSetNewGeometryBuffer(tree->geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3,
                              sizeof(Vec3f), mesh.vertices_m.size()));
  auto* indices = static_cast<std::array<std::uint32_t, 3>*>(
      rtcSetNewGeometryBuffer(tree->geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3,
                              3 * sizeof(std::uint32_t), mesh.triangles.size()));
  check(tree->device);  // buffers are null if memory ran out
  std::copy(mesh.vertices_m.begin(), mesh.vertices_m.end(), vertices);
  std::copy(mesh.triangles.begin(), mesh.triangles.end(), indices);
  rtcSetGeometryMask(tree->geometry, 0xffffffff);  // Embree 4's default is 1
  rtcCommitGeometry(tree->geometry);
  rtcAttachGeometry(tree->scene, tree->geometry);
  rtcCommitScene(tree->scene);
  check(tree->device);
  return tree;
}

OcclusionGeometry::OcclusionGeometry(const Mesh& mesh, std::span<const Material> materials,
                                     BuildQuality quality)
    : materials_(mesh.materials), embree_(std::make_unique<Embree>()) {
  for (const Material& material : materials) {
    Bands& through = transmission_.emplace_back(material.transmission);
    for (std::size_t b = 0; b < kBandCount; ++b) {
      through[b] = std::min(through[b], material.absorption[b]);
      transmits_ |= through[b] > 0;
    }
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
        std::async(std::launch::async, [mesh = mesh_to_improve_]() -> std::unique_ptr<Embree> {
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
  RTCRayHit ray;
  ray.ray = ray_between(from_m, to_m, near);
  ray.hit.geomID = RTC_INVALID_GEOMETRY_ID;
  ray.hit.primID = RTC_INVALID_GEOMETRY_ID;
  ray.hit.instID[0] = RTC_INVALID_GEOMETRY_ID;
#if RTC_VERSION_MAJOR >= 4
  rtcIntersect1(embree_->scene, &ray);
#else
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  rtcIntersect1(embree_->scene, &context, &ray);
#endif
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
#if RTC_VERSION_MAJOR >= 4
  RTCIntersectArguments arguments;
  rtcInitIntersectArguments(&arguments);
  arguments.flags = RTC_RAY_QUERY_FLAG_COHERENT;
  rtcIntersect16(valid.data(), embree_->scene, &rays, &arguments);
#else
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  context.flags = RTC_INTERSECT_CONTEXT_FLAG_COHERENT;
  rtcIntersect16(valid.data(), embree_->scene, &context, &rays);
#endif
  for (std::size_t l = 0; l < kPacketRays; ++l)
    if (valid[l] != 0 && rays.hit.geomID[l] != RTC_INVALID_GEOMETRY_ID)
      surfaces[l] = &planes_[rays.hit.primID[l]];
}

bool OcclusionGeometry::is_free(const Vec3f& from_m, const Vec3f& to_m) const {
  if (empty()) return true;
  RTCRay ray = ray_between(from_m, to_m, 0);
#if RTC_VERSION_MAJOR >= 4
  rtcOccluded1(embree_->scene, &ray);
#else
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  rtcOccluded1(embree_->scene, &context, &ray);
#endif
  return ray.tfar > 0;
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
