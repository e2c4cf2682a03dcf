#include "bake/trace/scene.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <string>

#include "formats/level/embree_mesh.h"

namespace clamor {

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

constexpr float kInfinity = std::numeric_limits<float>::infinity();

}  // namespace

std::string embree_version() { return RTC_VERSION_STRING; }

Scene::Scene(const Mesh& mesh, Build build) : mesh_(mesh) {
  if (mesh.triangles.empty()) return;  // free field

  offset_m_ = 1e-5 * bounds_of(mesh).diagonal_m();

  embree_ = std::make_unique<EmbreeMesh>(
      mesh, EmbreeMesh::Options{
                .quality = build == Build::kQuick ? RTC_BUILD_QUALITY_LOW : RTC_BUILD_QUALITY_HIGH,
                .alone = true});
  // Alone, so that the triangles are always in the same order and a ray through an edge hits the
  // same one of its two triangles.
  embree_->build();

  surfaces_.reserve(mesh.triangles.size());
  for (std::uint32_t i = 0; i < mesh.triangles.size(); ++i)
    surfaces_.push_back(
        {mesh.vertices_m[mesh.triangles[i][0]], Vec3f(normal_of(mesh, i)), mesh.materials[i], 0});
}

Scene::~Scene() = default;

std::optional<Hit> Scene::intersect(const Vec3& origin_m, const Vec3& direction) const {
  if (embree_ == nullptr) return std::nullopt;

  const RTCRayHit ray = embree_->first_hit(Vec3f(origin_m), Vec3f(direction), 0, kInfinity);
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

bool Scene::see_each_other(const Vec3& a, const Vec3& b) const {
  const double apart_m = length(b - a);
  if (apart_m < 1e-6) return true;
  const auto hit = intersect(a, (b - a) / apart_m);
  return !hit || hit->distance_m >= apart_m * (1 - 1e-6);
}

bool Scene::is_occluded(const Vec3f& from_m, const Vec3f& to_m) const {
  return embree_ != nullptr && embree_->is_occluded(from_m, to_m);
}

void Scene::first_hits(std::span<const Ray> rays, std::span<SurfaceHit> hits) const {
  if (embree_ == nullptr) {
    for (SurfaceHit& hit : hits) hit.material = SurfaceHit::kNone;
    return;
  }
  // In large levels the surface data is not cached; prefetch it for several rays before reading it.
  constexpr std::size_t kTogether = 16;
  std::array<std::uint32_t, kTogether> triangles;
  for (std::size_t first = 0; first < rays.size(); first += kTogether) {
    const std::size_t count = std::min(kTogether, rays.size() - first);
    for (std::size_t i = 0; i < count; ++i) {
      const RTCRayHit found =
          embree_->first_hit(rays[first + i].origin_m, rays[first + i].direction, 0, kInfinity);
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
