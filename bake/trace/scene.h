// scene.h: ray casting against the triangles of a level, with Embree.
//
// Embree finds the triangle in single precision. The hit point is then computed in double from the
// triangle's vertices, so that it lies in the triangle's plane and does not depend on a CPU's
// reciprocal instructions.
//
// Threads: const functions may be called concurrently. Memory: about 200 bytes per triangle.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "common/vec.h"
#include "formats/level/mesh.h"

namespace clamor {

class EmbreeMesh;

struct Hit {
  Vec3 point_m;
  Vec3 normal;  // unit, on the ray's side of the surface
  double distance_m;
  std::uint16_t material;
  // The triangle's winding is clockwise as seen from the ray's origin.
  bool from_behind = false;
};

// A ray in single precision, for batches.
struct Ray {
  Vec3f origin_m, direction;
};
struct SurfaceHit {
  static constexpr std::uint32_t kNone = 0xffffffff;

  Vec3f normal;     // unit, on the ray's side of the surface
  float cos_i = 0;  // cosine between ray and normal
  float distance_m = 0;
  std::uint32_t material = kNone;  // kNone if the ray leaves the level
};

std::string embree_version();

class Scene {
 public:
  // kQuick builds five times faster and traces slower, for few rays.
  enum class Build { kThorough, kQuick };

  // The mesh must outlive the scene. Triangles without area are never hit. Throws std::bad_alloc or
  // std::runtime_error if Embree fails.
  explicit Scene(const Mesh& mesh, Build build = Build::kThorough);
  ~Scene();

  // The first hit in the unit direction, or nothing. Rays from a surface must start at
  // away_from_surface(), or they hit that surface again.
  std::optional<Hit> intersect(const Vec3& origin_m, const Vec3& direction) const;

  // Whether no surface lies between two points of the air.
  bool see_each_other(const Vec3& a, const Vec3& b) const;

  // Whether a surface lies between two points of the air, in single precision.
  bool is_occluded(const Vec3f& from_m, const Vec3f& to_m) const;

  // The first hit of each ray.
  void first_hits(std::span<const Ray> rays, std::span<SurfaceHit> hits) const;

  bool is_empty() const { return embree_ == nullptr; }  // a free field

  // Distance that away_from_surface() moves a point.
  double offset_m() const { return offset_m_; }

  // Moves a point along the normal by 1e-5 of the level's extent, 0.1 mm in a room of 10 m. That is
  // enough in single precision: one of 20 million rays leaks.
  Vec3 away_from_surface(const Vec3& point_m, const Vec3& normal) const {
    return point_m + normal * offset_m_;
  }

 private:
  struct Surface {
    Vec3f corner_m, normal;
    std::uint32_t material, unused;
  };
  static_assert(sizeof(Surface) == 32, "two to a cache line");

  double exact_distance_m(std::uint32_t triangle, const Ray& ray, double otherwise_m) const;

  const Mesh& mesh_;
  std::vector<Surface> surfaces_;  // per triangle
  double offset_m_ = 0;
  std::unique_ptr<EmbreeMesh> embree_;  // null for a free field
};

}  // namespace clamor
