#include "runtime/hrtf/direction_mesh.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <utility>

#include "common/random.h"

namespace clamor {

namespace {

constexpr int kLongestWalk = 256, kShortWalk = 4;
constexpr double kFlatDepth = 1e-3;

struct Face {
  std::array<std::uint32_t, 3> corner;  // counter-clockwise seen from outside
  Vec3 normal;
  double height = 0;
};

Face face_of(const std::vector<Vec3>& points, std::uint32_t a, std::uint32_t b, std::uint32_t c) {
  Face face{{a, b, c}, cross(points[b] - points[a], points[c] - points[a]), 0};
  face.height = dot(face.normal, points[a]);
  return face;
}

// The directions, each moved by a tiny pseudo-random offset.
std::vector<Vec3> shaken(std::span<const Vec3f> directions) {
  constexpr double kReach = 2e-7;
  std::vector<Vec3> points;
  for (const Vec3f& direction : directions) {
    const RandomBits bits = philox(7, {static_cast<std::uint32_t>(points.size()), 0, 0, 0});
    points.push_back(normalize(Vec3(direction)) +
                     kReach * Vec3(unit(bits[0]) - 0.5, unit(bits[1]) - 0.5, unit(bits[2]) - 0.5));
  }
  return points;
}

// Four points that are not coplanar and far apart, so that the rest lies outside.
std::array<std::uint32_t, 4> first_corners(const std::vector<Vec3>& points) {
  const auto best = [&](auto&& measure) {
    std::uint32_t most = 0;
    for (std::uint32_t p = 1; p < points.size(); ++p)
      if (measure(points[p]) > measure(points[most])) most = p;
    return most;
  };
  const std::uint32_t a = 0;
  const std::uint32_t b = best([&](const Vec3& p) { return length(p - points[a]); });
  const std::uint32_t c =
      best([&](const Vec3& p) { return length(cross(p - points[a], points[b] - points[a])); });
  const Vec3 normal = cross(points[b] - points[a], points[c] - points[a]);
  const std::uint32_t d = best([&](const Vec3& p) { return std::abs(dot(normal, p - points[a])); });
  return {a, b, c, d};
}

std::vector<Face> hull_of(const std::vector<Vec3>& points) {
  auto [a, b, c, d] = first_corners(points);
  if (dot(cross(points[b] - points[a], points[c] - points[a]), points[d] - points[a]) > 0)
    std::swap(b, c);
  std::vector<Face> faces = {face_of(points, a, b, c), face_of(points, a, c, d),
                             face_of(points, c, b, d), face_of(points, b, a, d)};
  std::vector<std::pair<std::uint32_t, std::uint32_t>> edges;
  for (std::uint32_t p = 0; p < points.size(); ++p) {
    if (p == a || p == b || p == c || p == d) continue;
    // The horizon of the visible faces: edges whose other side is not visible.
    edges.clear();
    std::erase_if(faces, [&](const Face& face) {
      if (!(dot(face.normal, points[p]) > face.height)) return false;
      for (std::size_t k = 0; k < 3; ++k)
        edges.emplace_back(face.corner[k], face.corner[(k + 1) % 3]);
      return true;
    });
    std::ranges::sort(edges);
    for (const auto& [from, to] : edges)
      if (!std::ranges::binary_search(edges, std::pair(to, from)))
        faces.push_back(face_of(points, from, to, p));
  }
  return faces;
}

// Distance from the centre to the nearest face. The hull contains a ball of this radius, however
// thin a face is.
double depth_of(const std::vector<Face>& faces) {
  double depth = 1;
  for (const Face& face : faces) {
    const double area = length(face.normal);
    depth = std::min(depth, area > 0 ? face.height / area : 0);
  }
  return depth > kFlatDepth ? depth : 0;
}

}  // namespace

DirectionMesh::DirectionMesh(std::span<const Vec3f> directions) {
  if (directions.size() < 4) return;
  const std::vector<Vec3> points = shaken(directions);
  const std::vector<Face> faces = hull_of(points);
  depth_ = depth_of(faces);
  if (depth_ == 0) return;
  std::map<std::pair<std::uint32_t, std::uint32_t>, std::uint32_t> face_of_edge;
  for (std::uint32_t f = 0; f < faces.size(); ++f)
    for (std::size_t k = 0; k < 3; ++k)
      face_of_edge[{faces[f].corner[k], faces[f].corner[(k + 1) % 3]}] = f;
  for (const Face& face : faces) {
    Triangle& triangle = triangles_.emplace_back();
    triangle.corner = face.corner;
    for (std::size_t k = 0; k < 3; ++k) {
      const std::uint32_t next = face.corner[(k + 1) % 3], last = face.corner[(k + 2) % 3];
      triangle.across[k] = face_of_edge.at({last, next});
      const auto share = Vec3f(cross(points[next], points[last]) / face.height);
      for (std::size_t axis = 0; axis < 3; ++axis)
        triangle.share[3 * axis + k] = share[static_cast<int>(axis)];
    }
  }
  // For each cell of a cube around the sphere: the triangle at its middle, found from its
  // neighbour's.
  near_.resize(6 * kCells * kCells);
  std::uint32_t found = 0;
  for (int face = 0; face < 6; ++face)
    for (int i = 0; i < kCells; ++i)
      for (int j = 0; j < kCells; ++j) {
        const int axis = face / 2;
        Vec3f middle(0);
        middle[axis] = face % 2 == 0 ? 1.0f : -1.0f;
        middle[(axis + 1) % 3] = (2.0f * static_cast<float>(i) + 1) / kCells - 1;
        middle[(axis + 2) % 3] = (2.0f * static_cast<float>(j) + 1) / kCells - 1;
        Shares shares;
        walk(normalize(middle), kLongestWalk, found, shares);
        near_[cell_of(middle)] = found;
      }
}

std::size_t DirectionMesh::cell_of(const Vec3f& v) noexcept REALTIME {
  int axis = 0;
  for (int other = 1; other < 3; ++other)
    if (std::abs(v[other]) > std::abs(v[axis])) axis = other;
  const float scale = std::max(std::abs(v[axis]), 1e-20f);
  const auto cell = [&](float at) {
    return static_cast<std::size_t>(
        std::clamp(static_cast<int>((at / scale + 1) * (kCells / 2)), 0, kCells - 1));
  };
  const std::size_t face = static_cast<std::size_t>(2 * axis + (v[axis] < 0 ? 1 : 0));
  return (face * kCells + cell(v[(axis + 1) % 3])) * kCells + cell(v[(axis + 2) % 3]);
}

DirectionMesh::Shares DirectionMesh::shares_of(const Triangle& triangle,
                                               const Vec3f& v) noexcept REALTIME {
  const float* const of = triangle.share.data();
  Shares shares;  // a vector of four; the last element is unused
  for (std::size_t k = 0; k < shares.size(); ++k)
    shares[k] = of[k] * v.x + of[3 + k] * v.y + of[6 + k] * v.z;
  return shares;
}

bool DirectionMesh::walk(const Vec3f& direction, int most, std::uint32_t& triangle,
                         Shares& shares) const noexcept REALTIME {
  for (int steps = 0;; ++steps) {
    const Triangle& here = triangles_[triangle];
    shares = shares_of(here, direction);
    if (std::min({shares[0], shares[1], shares[2]}) >= -1e-6f) return true;
    if (steps == most) return false;
    std::size_t outside = 0;
    for (std::size_t k = 1; k < 3; ++k)
      if (shares[k] < shares[outside]) outside = k;
    triangle = here.across[outside];
  }
}

DirectionMesh::Place DirectionMesh::place_in(const Triangle& triangle,
                                             const Shares& shares) noexcept REALTIME {
  Place place{triangle.corner, {}};
  float sum = 0;
  for (std::size_t k = 0; k < 3; ++k) sum += place.share[k] = std::max(0.0f, shares[k]);
  const float over = 1 / sum;
  for (float& share : place.share) share = sum > 0 ? share * over : 1.0f / 3;
  return place;
}

DirectionMesh::Place DirectionMesh::find(const Vec3f& direction) const noexcept REALTIME {
  std::uint32_t triangle = near_[cell_of(direction)];
  Shares shares;
  walk(direction, kLongestWalk, triangle, shares);
  return place_in(triangles_[triangle], shares);
}

DirectionMesh::Place DirectionMesh::find(const Vec3f& direction,
                                         std::uint32_t& last) const noexcept REALTIME {
  Shares shares;
  if (!walk(direction, kShortWalk, last, shares)) {
    last = near_[cell_of(direction)];
    walk(direction, kLongestWalk, last, shares);
  }
  return place_in(triangles_[last], shares);
}

}  // namespace clamor
