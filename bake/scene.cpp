#include "bake/scene.h"

#if __has_include(<embree4/rtcore.h>)
#include <embree4/rtcore.h>
#else
#include <embree3/rtcore.h>
#endif

#include <algorithm>
#include <cmath>
#include <limits>

namespace clamor {

struct Scene::Embree {
  RTCDevice device = nullptr;
  RTCScene scene = nullptr;

  ~Embree() {
    if (scene != nullptr) rtcReleaseScene(scene);
    if (device != nullptr) rtcReleaseDevice(device);
  }
};

Scene::Scene(const Mesh& mesh) : mesh_(mesh), embree_(std::make_unique<Embree>()) {
  if (mesh.triangles.empty()) return;  // a free field

  Vec3f low = mesh.vertices_m[mesh.triangles[0][0]], high = low;
  for (const auto& triangle : mesh.triangles)
    for (const auto corner : triangle) {
      low = glm::min(low, mesh.vertices_m[corner]);
      high = glm::max(high, mesh.vertices_m[corner]);
    }
  offset_m_ = 1e-5 * length(Vec3(high) - Vec3(low));

  embree_->device = rtcNewDevice(nullptr);
  embree_->scene = rtcNewScene(embree_->device);
  rtcSetSceneBuildQuality(embree_->scene, RTC_BUILD_QUALITY_HIGH);

  const RTCGeometry geometry = rtcNewGeometry(embree_->device, RTC_GEOMETRY_TYPE_TRIANGLE);
  auto* vertices = static_cast<Vec3f*>(rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0,
                                                               RTC_FORMAT_FLOAT3, sizeof(Vec3f),
                                                               mesh.vertices_m.size()));
  std::copy(mesh.vertices_m.begin(), mesh.vertices_m.end(), vertices);
  auto* indices = static_cast<std::array<std::uint32_t, 3>*>(
      rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3,
                              3 * sizeof(std::uint32_t), mesh.triangles.size()));
  std::copy(mesh.triangles.begin(), mesh.triangles.end(), indices);
  rtcSetGeometryMask(geometry, 0xffffffff);  // Embree 4's default is 1
  rtcCommitGeometry(geometry);
  rtcAttachGeometry(embree_->scene, geometry);
  rtcReleaseGeometry(geometry);
  rtcCommitScene(embree_->scene);
}

Scene::~Scene() = default;

std::optional<Hit> Scene::intersect(const Vec3& origin_m, const Vec3& direction) const {
  if (embree_->scene == nullptr) return std::nullopt;

  RTCRayHit ray{};
  ray.ray.org_x = static_cast<float>(origin_m.x);
  ray.ray.org_y = static_cast<float>(origin_m.y);
  ray.ray.org_z = static_cast<float>(origin_m.z);
  ray.ray.dir_x = static_cast<float>(direction.x);
  ray.ray.dir_y = static_cast<float>(direction.y);
  ray.ray.dir_z = static_cast<float>(direction.z);
  ray.ray.tfar = std::numeric_limits<float>::infinity();
  ray.ray.mask = 0xffffffff;
  ray.hit.geomID = RTC_INVALID_GEOMETRY_ID;
#if RTC_VERSION_MAJOR >= 4
  rtcIntersect1(embree_->scene, &ray);
#else
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  rtcIntersect1(embree_->scene, &context, &ray);
#endif
  if (ray.hit.geomID == RTC_INVALID_GEOMETRY_ID) return std::nullopt;

  const auto& triangle = mesh_.triangles[ray.hit.primID];
  const Vec3 a = mesh_.vertices_m[triangle[0]];
  const Vec3 b = mesh_.vertices_m[triangle[1]];
  const Vec3 c = mesh_.vertices_m[triangle[2]];
  Vec3 normal = normalize(cross(b - a, c - a));
  double falling = dot(direction, normal);
  if (falling > 0) {
    normal = -normal;
    falling = -falling;
  }
  // A ray in the triangle's plane has no intersection of its own with it: take Embree's word.
  double distance_m = falling < -1e-9 ? dot(a - origin_m, normal) / falling : ray.ray.tfar;
  distance_m = std::max(distance_m, 0.0);
  return Hit{origin_m + direction * distance_m, normal, distance_m,
             mesh_.materials[ray.hit.primID]};
}

}  // namespace clamor
