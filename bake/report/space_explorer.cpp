#include "bake/report/space_explorer.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "bake/trace/diffuse_directions.h"
#include "common/bounds.h"
#include "common/random.h"
#include "common/sphere.h"

namespace clamor {

namespace {

constexpr std::uint64_t kKey = 0x61756469626c65u;  // of the random numbers
constexpr std::uint32_t kLegs = 32;
constexpr double kFewEscape = 0.1;    // maximum share of escaping walks at an enclosed point
constexpr double kClosedShare = 0.5;  // enclosed share of the bounds of a closed level
constexpr double kClearance_m = 0.2;  // clearance of proposed points, in levels of 10 m or more
constexpr double kAboveSurface_m =
    0.01;  // start distance of rays that look for a surface at a point
// Mean transmission of the bands from which on positions count as heard through a surface: 15 dB.
// Closed doors have 0.029 (hollow wood), windows and panels of wood 0.01, so that they are walls of
// the space; curtains have 0.2.
constexpr double kHeardThrough = 0.03;
constexpr std::size_t kMaxInside = 96;  // sample points of the enclosed space

double interval(std::vector<double> values) {
  std::sort(values.begin(), values.end());
  return values[values.size() * 9 / 10] - values[values.size() / 10];
}

}  // namespace

Vec3 rounded_to_cm(const Vec3& place_m) { return glm::round(place_m * 100.0) / 100.0; }

bool Exploration::is_enclosed() const {
  return static_cast<double>(escaped) <= kFewEscape * SpaceExplorer::kWalks;
}

SpaceExplorer::SpaceExplorer(const Scene& scene, const Mesh& mesh,
                             std::span<const Material> materials)
    : scene_(scene), materials_(materials), empty_(mesh.triangles.empty()) {
  if (empty_) return;
  const Boundsf bounds = bounds_of(mesh);
  low_m_ = Vec3(bounds.low_m);
  high_m_ = Vec3(bounds.high_m);

  constexpr std::uint32_t kRays = 24;
  std::size_t closed_in = 0;
  std::vector<Vec3> inside_m;
  const std::vector<Vec3> grid = grid_m();
  for (const Vec3& place_m : grid) {
    std::uint32_t hits = 0;
    for (std::uint32_t i = 0; i < kRays; ++i)
      hits += scene_.intersect(place_m, spread_direction(i, kRays)).has_value();
    if (hits + 1 < kRays) continue;
    ++closed_in;
    if (has_clearance(place_m)) inside_m.push_back(place_m);
  }
  closed_ = static_cast<double>(closed_in) >= kClosedShare * static_cast<double>(grid.size());
  inside_m_ = thinned<Vec3>(inside_m, kMaxInside);
}

// Cell centres of a coarse grid over the level's bounds.
std::vector<Vec3> SpaceExplorer::grid_m() const {
  std::vector<Vec3> places_m;
  constexpr int kAcross = 10, kUp = 6;
  for (int x = 0; x < kAcross; ++x)
    for (int y = 0; y < kUp; ++y)
      for (int z = 0; z < kAcross; ++z)
        places_m.push_back(
            rounded_to_cm(low_m_ + (high_m_ - low_m_) * Vec3((x + 0.5) / kAcross, (y + 0.5) / kUp,
                                                             (z + 0.5) / kAcross)));
  return places_m;
}

bool SpaceExplorer::is_heard_through(std::uint16_t material) const {
  return material < materials_.size() &&
         sum_of(materials_[material].transmission) >= kHeardThrough * kBandCount;
}

Exploration SpaceExplorer::explore(const Vec3& from_m) const {
  Exploration found;
  for (std::uint32_t walk = 0; walk < kWalks; ++walk) {
    Vec3 at_m = from_m, direction = spread_direction(walk, kWalks);
    for (std::uint32_t leg = 0; leg < kLegs; ++leg) {
      const auto hit = scene_.intersect(at_m, direction);
      if (!hit) {
        ++found.escaped;
        found.direct += leg == 0;
        break;
      }
      found.legs_m += hit->distance_m;
      found.behind += hit->from_behind;
      found.transmits |= is_heard_through(hit->material);
      at_m = scene_.away_from_surface(hit->point_m, hit->normal);
      found.points_m.push_back(at_m);
      direction = diffuse_direction(hit->normal, philox(kKey, {walk, leg, 0, 0}));
    }
  }
  return found;
}

double SpaceExplorer::share_of_bounds(const Exploration& found) const {
  double share = 1;
  for (int axis = 0; axis < 3; ++axis) {
    const double all_m = high_m_[axis] - low_m_[axis];
    std::vector<double> along;
    for (const Vec3& point_m : found.points_m) along.push_back(point_m[axis]);
    if (all_m > 1e-6) share *= std::min(1.0, interval(std::move(along)) / all_m);
  }
  return share;
}

bool SpaceExplorer::sees(const Vec3& from_m, const Vec3& to_m) const {
  const Vec3 path_m = to_m - from_m;
  double left_m = length(path_m);
  if (!(left_m > 0)) return true;
  const Vec3 direction = path_m / left_m;
  Vec3 at_m = from_m;
  for (int crossing = 0; crossing < 32; ++crossing) {
    const auto hit = scene_.intersect(at_m, direction);
    // A point at offset_m() in front of a wall is not visible through that wall.
    if (!hit || hit->distance_m >= left_m - 0.25 * scene_.offset_m()) return true;
    if (!is_heard_through(hit->material)) return false;
    const double step_m = hit->distance_m + scene_.offset_m();
    at_m += direction * step_m;
    left_m -= step_m;
  }
  return false;
}

bool SpaceExplorer::any_sees(std::span<const Vec3> some_m, std::span<const Vec3> others_m) const {
  return std::any_of(some_m.begin(), some_m.end(), [&](const Vec3& one_m) {
    return std::any_of(others_m.begin(), others_m.end(),
                       [&](const Vec3& other_m) { return sees(one_m, other_m); });
  });
}

bool SpaceExplorer::bends_to(const Vec3& from_m, const Vec3& to_m) const {
  const Vec3 path_m = to_m - from_m;
  if (!(length(path_m) > 0)) return true;
  const Basis across = basis_around(normalize(path_m));
  constexpr int kTurns = 8;
  for (const double beside_m : {0.5, 1.0, 2.0, 4.0, 8.0})
    for (int turn = 0; turn < kTurns; ++turn) {
      const Vec3 around = on_sphere(0, turn / static_cast<double>(kTurns));
      const Vec3 over_m = from_m + 0.5 * path_m +
                          beside_m * (around.x * across.tangent + around.y * across.bitangent);
      if (sees(from_m, over_m) && sees(over_m, to_m)) return true;
    }
  return false;
}

bool SpaceExplorer::has_clearance(const Vec3& place_m) const {
  const double clearance_m = std::min(kClearance_m, 0.02 * extent_m());
  constexpr std::uint32_t kRays = 26;
  for (std::uint32_t i = 0; i < kRays; ++i) {
    const auto hit = scene_.intersect(place_m, spread_direction(i, kRays));
    if (hit && hit->distance_m < clearance_m) return false;
  }
  return true;
}

std::vector<Vec3> SpaceExplorer::candidates_m(const Vec3& from_m) const {
  std::vector<Vec3> places_m = grid_m();
  const Vec3 margin_m(0.01);
  for (const double radius_m : {0.3, 0.5, 0.75, 1.0, 1.5, 2.0, 3.0, 4.5})
    for (int x = -1; x <= 1; ++x)
      for (int y = -1; y <= 1; ++y)
        for (int z = -1; z <= 1; ++z) {
          if (x == 0 && y == 0 && z == 0) continue;
          const Vec3 place_m = rounded_to_cm(from_m + radius_m * normalize(Vec3(x, y, z)));
          if (glm::all(glm::greaterThan(place_m, low_m_ + margin_m)) &&
              glm::all(glm::lessThan(place_m, high_m_ - margin_m)))
            places_m.push_back(place_m);
        }
  // Points at the same height are preferred.
  const auto cost = [&](const Vec3& place_m) {
    const Vec3 path_m = place_m - from_m;
    return length(path_m) + 0.3 * std::abs(path_m.y);
  };
  std::stable_sort(places_m.begin(), places_m.end(),
                   [&](const Vec3& a, const Vec3& b) { return cost(a) < cost(b); });
  return places_m;
}

std::optional<Vec3> SpaceExplorer::surface_at(const Vec3& place_m, double within_m) const {
  constexpr std::uint32_t kRays = 12;
  std::uint32_t at_surface = 0;
  Vec3 normal{};
  for (std::uint32_t i = 0; i < kRays; ++i) {
    const Vec3 off = spread_direction(i, kRays);
    const auto hit = scene_.intersect(place_m + kAboveSurface_m * off, -off);
    if (!hit ||
        std::abs(hit->distance_m - kAboveSurface_m) * std::abs(dot(hit->normal, off)) > within_m)
      continue;
    ++at_surface;
    normal = hit->normal;
  }
  if (at_surface + 2 < kRays) return std::nullopt;
  return normal;
}

}  // namespace clamor
