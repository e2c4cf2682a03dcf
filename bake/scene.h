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

#include "common/vec.h"
#include "formats/level.h"

namespace clamor {

struct Hit {
  Vec3 point_m;
  Vec3 normal;  // unit, on the side the ray came from
  double distance_m;
  std::uint16_t material;
};

class Scene {
 public:
  // The mesh must outlive the scene. Triangles without area cannot be hit.
  explicit Scene(const Mesh& mesh);
  ~Scene();

  // The first surface in the unit direction, or nothing. From a point on a surface, start at
  // away_from_surface(), or the ray hits where it stands.
  std::optional<Hit> intersect(const Vec3& origin_m, const Vec3& direction) const;

  // The point, moved along the normal by 1e-5 of the level's extent. Far enough that single
  // precision keeps it on its side (one of 20 million rays leaks), 0.1 mm in a room of 10 m.
  Vec3 away_from_surface(const Vec3& point_m, const Vec3& normal) const {
    return point_m + normal * offset_m_;
  }

 private:
  struct Embree;
  const Mesh& mesh_;
  double offset_m_ = 0;
  std::unique_ptr<Embree> embree_;
};

}  // namespace clamor
