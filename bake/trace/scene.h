// scene.h: the level's triangles as something rays can hit. Embree ends here.
//
// Embree says which triangle is hit, in single precision; where exactly is then computed from the
// triangle's own vertices in double, so that a hit point lies on its plane and does not depend on
// the reciprocals of this or that CPU.
//
// Threads: intersect() from any number at once.   Memory: about 200 bytes per triangle.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "common/vec.h"
#include "formats/level/level.h"

namespace clamor {

struct Hit {
  Vec3 point_m;
  Vec3 normal;  // unit, on the side the ray came from
  double distance_m;
  std::uint16_t material;
  bool from_behind = false;  // the triangle's corners are clockwise as the ray sees them
};

// The same in single precision, for many rays at once.
struct Ray {
  Vec3f origin_m, direction;
};
struct SurfaceHit {
  static constexpr std::uint32_t kNone = 0xffffffff;

  Vec3f normal;     // unit, on the side the ray came from
  float cos_i = 0;  // of the ray's angle to the normal
  float distance_m = 0;
  std::uint32_t material = kNone;  // kNone where the ray leaves the level
};

// How Embree is opened, and what its version is.
const char* embree_device();
std::string embree_version();

class Scene {
 public:
  // For a few rays: a tree that is built in a fifth of the time.
  enum class Build { kThorough, kQuick };

  // The mesh must outlive the scene. Triangles without area cannot be hit.
  explicit Scene(const Mesh& mesh, Build build = Build::kThorough);
  ~Scene();

  // The first surface in the unit direction, or nothing. From a point on a surface, start at
  // away_from_surface(), or the ray hits where it stands.
  std::optional<Hit> intersect(const Vec3& origin_m, const Vec3& direction) const;

  // The first surface of each ray.
  void first_hits(std::span<const Ray> rays, std::span<SurfaceHit> hits) const;

  // How far away_from_surface() moves.
  double offset_m() const { return offset_m_; }

  // The point, moved along the normal by 1e-5 of the level's extent. Far enough that single
  // precision keeps it on its side (one of 20 million rays leaks), 0.1 mm in a room of 10 m.
  Vec3 away_from_surface(const Vec3& point_m, const Vec3& normal) const {
    return point_m + normal * offset_m_;
  }

 private:
  struct Embree;
  struct Surface {
    Vec3f corner_m, normal;
    std::uint32_t material, unused;
  };
  static_assert(sizeof(Surface) == 32, "two to a cache line");

  double exact_distance_m(std::uint32_t triangle, const Ray& ray, double otherwise_m) const;

  const Mesh& mesh_;
  std::vector<Surface> surfaces_;  // per triangle
  double offset_m_ = 0;
  std::unique_ptr<Embree> embree_;
};

}  // namespace clamor
