#include "bake/mesh/collapse_distance.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace clamor {

namespace {

constexpr double kMinCosine = 0.5;
constexpr std::size_t kMaxRing = 40;  // the number of crossings is quadratic in this

// A point projected onto the plane of the fan, with its height above that plane.
struct Point {
  double x, y, height;
};

double area_sign(const Point& a, const Point& b, const Point& c) {
  return (b.x - a.x) * (c.y - a.y) - (b.y - a.y) * (c.x - a.x);
}

// Height difference at the crossing of segments ab and cd; 0 if they do not cross.
double crossing_m(const Point& a, const Point& b, const Point& c, const Point& d) {
  const double to_c = area_sign(a, b, c), to_d = area_sign(a, b, d);
  const double to_a = area_sign(c, d, a), to_b = area_sign(c, d, b);
  if (!(to_c * to_d < 0 && to_a * to_b < 0)) return 0;
  const double s = to_a / (to_a - to_b), t = to_c / (to_c - to_d);
  return std::abs((a.height + s * (b.height - a.height)) - (c.height + t * (d.height - c.height)));
}

// Returns whether the smallest height of the triangle is at most `thin_m`.
bool is_thin(const Vec3& a, const Vec3& b, const Vec3& c, double thin_m) {
  const double longest2 = std::max({dot(b - a, b - a), dot(c - b, c - b), dot(a - c, a - c)});
  const Vec3 across = cross(b - a, c - a);
  return dot(across, across) <= thin_m * thin_m * longest2;
}

bool faces_along(const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& normal) {
  const Vec3 across = cross(b - a, c - a);
  const double along = dot(across, normal);
  return along > 0 && along * along >= kMinCosine * kMinCosine * dot(across, across);
}

// Vertical distance of a point to the fan of triangles from ring[0]; nothing if none lies over it.
std::optional<double> height_over_fan_m(std::span<const Point> ring, const Point& middle) {
  std::optional<double> greatest_m;
  for (std::size_t i = 1; i + 1 < ring.size(); ++i) {
    const Point &a = ring[0], &b = ring[i], &c = ring[i + 1];
    const double whole = area_sign(a, b, c);
    const double at_b = area_sign(a, middle, c) / whole, at_c = area_sign(a, b, middle) / whole;
    if (at_b < -1e-9 || at_c < -1e-9 || at_b + at_c > 1 + 1e-9) continue;
    const double height = a.height + at_b * (b.height - a.height) + at_c * (c.height - a.height);
    greatest_m = std::max(greatest_m.value_or(0), std::abs(height - middle.height));
  }
  return greatest_m;
}

}  // namespace

std::optional<double> collapse_distance_m(const Vec3& centre, std::span<const Vec3> ring,
                                          bool closed, double thin_m) {
  const std::size_t count = ring.size();
  if (count < 3 || count > kMaxRing) return std::nullopt;
  const std::size_t old_faces = closed ? count : count - 1;

  Vec3 normal(0);
  for (std::size_t i = 0; i < old_faces; ++i)
    normal += cross(ring[i] - centre, ring[(i + 1) % count] - centre);
  const double size = length(normal);
  if (!(size > 0)) return std::nullopt;
  normal = normal / size;

  Vec3 foot = centre;
  if (!closed) {
    const Vec3 line = ring[0] - ring.back();
    const double line2 = dot(line, line);
    if (!(line2 > 0)) return std::nullopt;
    const double along = dot(centre - ring.back(), line) / line2;
    if (!(along > 0 && along < 1)) return std::nullopt;
    foot = ring.back() + line * along;
  }
  for (std::size_t i = 0; i < old_faces; ++i) {
    const Vec3 &a = ring[i], &b = ring[(i + 1) % count];
    // The normal of a sliver is meaningless, but its surface lies within its sides.
    if (!is_thin(centre, a, b, thin_m) && !faces_along(centre, a, b, normal)) return std::nullopt;
    if (!closed && !is_thin(foot, a, b, thin_m) && !faces_along(foot, a, b, normal))
      return std::nullopt;
  }
  for (std::size_t i = 1; i + 1 < count; ++i)
    if (is_thin(ring[0], ring[i], ring[i + 1], thin_m) ||
        !faces_along(ring[0], ring[i], ring[i + 1], normal))
      return std::nullopt;

  const Basis basis = basis_around(normal);
  const auto flat = [&](const Vec3& p) {
    const Vec3 from = p - ring[0];
    return Point{dot(from, basis.tangent), dot(from, basis.bitangent), dot(from, normal)};
  };
  std::array<Point, kMaxRing> points;
  for (std::size_t i = 0; i < count; ++i) points[i] = flat(ring[i]);
  const Point middle = flat(foot);

  double greatest_m = 0;
  for (std::size_t spoke = 2; spoke + 1 < count; ++spoke)
    for (std::size_t old = 1; old < count; ++old)
      if (old != spoke)
        greatest_m =
            std::max(greatest_m, crossing_m(points[0], points[spoke], middle, points[old]));
  if (closed) {
    const auto height_m = height_over_fan_m(std::span(points).first(count), middle);
    if (!height_m) return std::nullopt;
    greatest_m = std::max(greatest_m, *height_m);
  }
  return greatest_m + length(foot - centre);
}

}  // namespace clamor
