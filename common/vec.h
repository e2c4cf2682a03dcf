// vec.h: vectors in metres or of unit length, right-handed, +Y up, as in glTF.
//
// Double where work is offline and sums are long, float where millions are stored.
#pragma once

#include <cmath>

#include <glm/glm.hpp>
#include <glm/gtc/quaternion.hpp>

namespace clamor {

using Vec3 = glm::dvec3;
using Vec3f = glm::vec3;
using Rotation = glm::quat;     // a rotation, of unit length
using Quaternion = glm::dquat;  // the same in double
using Matrix = glm::dmat3;

using glm::cross;
using glm::dot;
using glm::length;
using glm::normalize;

inline bool is_finite(const Vec3& v) {
  return std::isfinite(v.x) && std::isfinite(v.y) && std::isfinite(v.z);
}

// Two unit vectors that form a right-handed basis with the unit vector n.
//
// Tom Duff et al. Building an Orthonormal Basis, Revisited. J. Computer Graphics Techniques 6(1),
// 2017. Exact and without a branch that jumps; error below 1e-15 everywhere.
struct Basis {
  Vec3 tangent, bitangent;
};
inline Basis basis_around(const Vec3& n) {
  const double sign = std::copysign(1.0, n.z);
  const double a = -1 / (sign + n.z);
  const double b = n.x * n.y * a;
  return {Vec3(1 + sign * n.x * n.x * a, sign * b, -sign * n.x),
          Vec3(b, sign + n.y * n.y * a, -n.y)};
}

}  // namespace clamor
