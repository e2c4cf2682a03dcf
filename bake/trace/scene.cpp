#include "bake/trace/scene.h"

#if __has_include(<embree4/rtcore.h>)
#include <embree4/rtcore.h>
#else
#include <embree3/rtcore.h>
#endif

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <new>
#include <stdexcept>
#include <string>

#include <tbb/task_arena.h>

namespace clamor {

struct Scene::Embree {
  RTCDevice device = nullptr;
  RTCScene scene = nullptr;
  RTCGeometry geometry = nullptr;

  // Embree reports a failure by a code that stays until somebody asks for it.
  void check() const {
    const RTCError error = rtcGetDeviceError(device);
    if (error == RTC_ERROR_OUT_OF_MEMORY) throw std::bad_alloc();
    if (device == nullptr || error != RTC_ERROR_NONE)
      throw std::runtime_error("Embree cannot build its tree of the level's surfaces (error " +
                               std::to_string(error) + ")");
  }

  ~Embree() {
    if (geometry != nullptr) rtcReleaseGeometry(geometry);
    if (scene != nullptr) rtcReleaseScene(scene);
    if (device != nullptr) rtcReleaseDevice(device);
  }

  RTCRayHit first_hit(const Ray& from) const {
    RTCRayHit ray;
    ray.ray.org_x = from.origin_m.x;
    ray.ray.org_y = from.origin_m.y;
    ray.ray.org_z = from.origin_m.z;
    ray.ray.tnear = 0;
    ray.ray.dir_x = from.direction.x;
    ray.ray.dir_y = from.direction.y;
    ray.ray.dir_z = from.direction.z;
    ray.ray.time = 0;
    ray.ray.tfar = std::numeric_limits<float>::infinity();
    ray.ray.mask = 0xffffffff;
    ray.ray.id = 0;
    ray.ray.flags = 0;
    ray.hit.geomID = RTC_INVALID_GEOMETRY_ID;
    ray.hit.primID = RTC_INVALID_GEOMETRY_ID;
    ray.hit.instID[0] = RTC_INVALID_GEOMETRY_ID;
#if RTC_VERSION_MAJOR >= 4
    rtcIntersect1(scene, &ray);
#else
    RTCIntersectContext context;
    rtcInitIntersectContext(&context);
    rtcIntersect1(scene, &context, &ray);
#endif
    return ray;
  }
};

namespace {

// Unit normal given by the winding; zero for a triangle without area.
Vec3 normal_of(const Mesh& mesh, std::uint32_t triangle) {
  const auto& corners = mesh.triangles[triangle];
  const Vec3 a = mesh.vertices_m[corners[0]];
  const Vec3 across =
      cross(Vec3(mesh.vertices_m[corners[1]]) - a, Vec3(mesh.vertices_m[corners[2]]) - a);
  const double twice_area = length(across);
  return twice_area > 0 ? across / twice_area : Vec3(0);
}

// The hits must not depend on the machine. Embree's AVX2 and AVX-512 code uses fused multiply-add
// and another tree layout, so all machines use SSE4.2. This costs 20 to 30 % of the ray throughput
// (4.7 instead of 6.0 million rays per second on Sponza, 2.6 instead of 3.8 in another run). The
// tree is built by one thread, so that the triangles are always in the same order and a ray through
// an edge hits the same one of its two triangles.
constexpr const char* kDevice = "isa=sse4.2";

}  // namespace

const char* embree_device() { return kDevice; }
std::string embree_version() { return RTC_VERSION_STRING; }

Scene::Scene(const Mesh& mesh, Build build) : mesh_(mesh), embree_(std::make_unique<Embree>()) {
  if (mesh.triangles.empty()) return;  // free field

  Vec3f low = mesh.vertices_m[mesh.triangles[0][0]], high = low;
  for (const auto& triangle : mesh.triangles)
    for (const auto corner : triangle) {
      low = glm::min(low, mesh.vertices_m[corner]);
      high = glm::max(high, mesh.vertices_m[corner]);
    }
  offset_m_ = 1e-5 * length(Vec3(high) - Vec3(low));

  embree_->device = rtcNewDevice(kDevice);
  embree_->check();
  embree_->scene = rtcNewScene(embree_->device);
  embree_->check();
  rtcSetSceneBuildQuality(embree_->scene,
                          build == Build::kQuick ? RTC_BUILD_QUALITY_LOW : RTC_BUILD_QUALITY_HIGH);

  const RTCGeometry geometry = rtcNewGeometry(embree_->device, RTC_GEOMETRY_TYPE_TRIANGLE);
  embree_->geometry = geometry;
  embree_->check();
  auto* vertices = static_cast<Vec3f*>(rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0,
                                                               RTC_FORMAT_FLOAT3, sizeof(Vec3f),
                                                               mesh.vertices_m.size()));
  auto* indices = static_cast<std::array<std::uint32_t, 3>*>(
      rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3,
                              3 * sizeof(std::uint32_t), mesh.triangles.size()));
  embree_->check();  // both are null if memory is exhausted
  std::copy(mesh.vertices_m.begin(), mesh.vertices_m.end(), vertices);
  std::copy(mesh.triangles.begin(), mesh.triangles.end(), indices);
  rtcSetGeometryMask(geometry, 0xffffffff);  // Embree 4's default is 1
  rtcCommitGeometry(geometry);
  rtcAttachGeometry(embree_->scene, geometry);
  // An arena of one thread. (The device option "threads=1" would limit all of TBB.)
  tbb::task_arena(1).execute([this] { rtcCommitScene(embree_->scene); });
  embree_->check();

  surfaces_.reserve(mesh.triangles.size());
  for (std::uint32_t i = 0; i < mesh.triangles.size(); ++i)
    surfaces_.push_back(
        {mesh.vertices_m[mesh.triangles[i][0]], Vec3f(normal_of(mesh, i)), mesh.materials[i], 0});
}

Scene::~Scene() = default;

std::optional<Hit> Scene::intersect(const Vec3& origin_m, const Vec3& direction) const {
  if (embree_->scene == nullptr) return std::nullopt;

  const RTCRayHit ray = embree_->first_hit({Vec3f(origin_m), Vec3f(direction)});
  if (ray.hit.geomID == RTC_INVALID_GEOMETRY_ID) return std::nullopt;

  const Vec3 corner_m = mesh_.vertices_m[mesh_.triangles[ray.hit.primID][0]];
  Vec3 normal = normal_of(mesh_, ray.hit.primID);
  double falling = dot(direction, normal);
  const bool from_behind = falling > 0;
  if (from_behind) {
    normal = -normal;
    falling = -falling;
  }
  // For a ray in the triangle's plane the intersection is ill-defined; use Embree's distance.
  double distance_m = falling < -1e-9 ? dot(corner_m - origin_m, normal) / falling : ray.ray.tfar;
  distance_m = std::max(distance_m, 0.0);
  return Hit{origin_m + direction * distance_m, normal, distance_m, mesh_.materials[ray.hit.primID],
             from_behind};
}

double Scene::exact_distance_m(std::uint32_t triangle, const Ray& ray, double otherwise_m) const {
  const Vec3 normal = normal_of(mesh_, triangle);
  const double falling = dot(Vec3(ray.direction), normal);
  if (!(std::abs(falling) > 1e-9)) return otherwise_m;
  const Vec3 corner_m = mesh_.vertices_m[mesh_.triangles[triangle][0]];
  return dot(corner_m - Vec3(ray.origin_m), normal) / falling;
}

void Scene::first_hits(std::span<const Ray> rays, std::span<SurfaceHit> hits) const {
  if (embree_->scene == nullptr) {
    for (SurfaceHit& hit : hits) hit.material = SurfaceHit::kNone;
    return;
  }
  // In large levels the surface data is not cached; prefetch it for several rays before reading it.
  constexpr std::size_t kTogether = 16;
  std::array<std::uint32_t, kTogether> triangles;
  for (std::size_t first = 0; first < rays.size(); first += kTogether) {
    const std::size_t count = std::min(kTogether, rays.size() - first);
    for (std::size_t i = 0; i < count; ++i) {
      const RTCRayHit found = embree_->first_hit(rays[first + i]);
      triangles[i] =
          found.hit.geomID == RTC_INVALID_GEOMETRY_ID ? SurfaceHit::kNone : found.hit.primID;
      hits[first + i].distance_m = found.ray.tfar;
      if (triangles[i] != SurfaceHit::kNone) __builtin_prefetch(&surfaces_[triangles[i]]);
    }
    for (std::size_t i = 0; i < count; ++i) {
      SurfaceHit& hit = hits[first + i];
      if (triangles[i] == SurfaceHit::kNone) {
        hit.material = SurfaceHit::kNone;
        continue;
      }
      const Ray& ray = rays[first + i];
      const Surface& surface = surfaces_[triangles[i]];
      const float falling = dot(ray.direction, surface.normal);
      hit.normal = falling > 0 ? -surface.normal : surface.normal;
      hit.cos_i = std::min(std::abs(falling), 1.0f);
      hit.material = surface.material;
      // In single precision the error is at most 0.1 mm along the ray, except at grazing incidence.
      const float distance_m =
          hit.cos_i > 0.02f
              ? dot(surface.corner_m - ray.origin_m, surface.normal) / falling
              : static_cast<float>(exact_distance_m(triangles[i], ray, hit.distance_m));
      hit.distance_m = std::max(distance_m, 0.0f);
    }
  }
}

}  // namespace clamor
