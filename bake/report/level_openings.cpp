#include "bake/report/level_openings.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <optional>
#include <utility>

#include "bake/trace/diffuse_directions.h"
#include "common/bounds.h"
#include "common/disjoint_sets.h"
#include "common/random.h"
#include "common/sphere.h"
#include "formats/level/level.h"

namespace clamor {

namespace {

constexpr std::uint32_t kOpeningWalks = 2048, kMaxWalk = 64;
constexpr std::uint64_t kOpeningKey = 0x6f70656e696e67u;
constexpr double kMinPower = 1e-3;  // a walk ends below this share of its initial power
constexpr std::size_t kMaxOpenings = 6;
constexpr int kTellingLines = 16;

// A bundle is split if two points reduce the sum of squared distances below this share. Cutting one
// long slit in two leaves a quarter.
constexpr double kTwoOpenings = 0.2;

struct Escape {
  Vec3 origin_m, direction;
  double power;
  bool direct;  // whether the walk left without hitting a surface
};

// Mean reflectance over all bands.
double reflected(const Material& material) {
  double sum = 0;
  for (const float absorption : material.absorption) sum += 1 - static_cast<double>(absorption);
  return sum / kBandCount;
}

struct Walks {
  std::vector<Escape> escapes;
  std::size_t rays = 0, legs = 0;
  double legs_m = 0;
};

// The first hit from a surface that a ray along `incoming` has reached. In an acute corner, the
// point in front of one wall may lie behind the other: a ray that meets nothing is tried again from
// a point of the incoming ray, which is on the near side of both.
std::optional<Hit> next_hit(const Scene& scene, const Hit& at, const Vec3& incoming,
                            const Vec3& direction) {
  const auto hit = scene.intersect(scene.away_from_surface(at.point_m, at.normal), direction);
  if (hit) return hit;
  const double back_m = scene.offset_m() / std::max(1e-9, -dot(incoming, at.normal));
  return scene.intersect(at.point_m - incoming * std::min(back_m, 0.5 * at.distance_m), direction);
}

Walks walk(const Scene& scene, const Level& level, std::span<const Vec3> starts_m) {
  Walks walks;
  for (std::uint32_t i = 0; i < kOpeningWalks && !starts_m.empty(); ++i) {
    Vec3 from = starts_m[i * starts_m.size() / kOpeningWalks];
    RandomBits bits = philox(kOpeningKey, {i, 0, 0, 0});
    Vec3 direction = on_sphere(1 - 2 * unit(bits[0]), unit(bits[1]));
    double power = 1;
    auto hit = scene.intersect(from, direction);
    for (std::uint32_t leg = 1; leg <= kMaxWalk && power > kMinPower; ++leg) {
      ++walks.rays;
      if (!hit) {
        walks.escapes.push_back({from, direction, power, leg == 1});
        break;
      }
      if (leg > 1) {
        ++walks.legs;
        walks.legs_m += hit->distance_m;
      }
      power *= reflected(level.materials[hit->material]);
      bits = philox(kOpeningKey, {i, leg, 0, 0});
      const Vec3 incoming = std::exchange(direction, diffuse_direction(hit->normal, bits));
      from = scene.away_from_surface(hit->point_m, hit->normal);
      hit = next_hit(scene, *hit, incoming, direction);
    }
  }
  return walks;
}

double distance2_m2(const Escape& line, const Vec3& point_m) {
  const Vec3 offset_m = point_m - line.origin_m;
  const double along = dot(offset_m, line.direction);
  return std::max(0.0, dot(offset_m, offset_m) - along * along);
}

// A bundle of lines and the point nearest to all of them, where the sum of w (1 - d d^T) (x - o)
// vanishes.
struct Bundle {
  std::vector<Escape> lines;
  Vec3 point_m{};
  double power = 0, error = 0;  // power of the lines; weighted sum of their squared distances
  double escaped = 0;           // power of all lines, including those straight from an emitter
  Vec3 flow{}, squares{};       // power-weighted sums of directions and of their squares

  void fit() {
    glm::dmat3 sum(0.0);
    Vec3 right(0), mean(0);
    power = error = 0;
    for (const Escape& line : lines) {
      const glm::dmat3 across =
          (glm::dmat3(1.0) - glm::outerProduct(line.direction, line.direction)) * line.power;
      sum += across;
      right += across * line.origin_m;
      mean += line.origin_m * line.power;
      power += line.power;
    }
    // For nearly parallel lines, any point along them is as good.
    const bool parallel = !(glm::determinant(sum) > 1e-6 * power * power * power);
    point_m = parallel ? mean / power : glm::inverse(sum) * right;
    escaped = power;
    flow = squares = Vec3(0);
    for (const Escape& line : lines) {
      error += line.power * distance2_m2(line, point_m);
      flow += line.direction * line.power;
      squares += line.direction * line.direction * line.power;
    }
  }

  void add_straight(const Escape& line) {
    escaped += line.power;
    flow += line.direction * line.power;
    squares += line.direction * line.direction * line.power;
  }
};

// Splits a bundle by 2-means clustering, or returns nothing if two points fit hardly better than
// one.
std::optional<std::pair<Bundle, Bundle>> in_two(const Bundle& bundle) {
  if (bundle.lines.size() < 8) return std::nullopt;
  // The foot point on a distant line, and its mirror image, are the initial centres.
  const auto foot = [](const Escape& line, const Vec3& point_m) {
    return line.origin_m + line.direction * dot(point_m - line.origin_m, line.direction);
  };
  std::vector<double> away(bundle.lines.size());
  std::transform(bundle.lines.begin(), bundle.lines.end(), away.begin(),
                 [&](const Escape& line) { return distance2_m2(line, bundle.point_m); });
  // The 90th percentile is used, because the most distant line may be an outlier.
  std::vector<std::size_t> order(away.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::stable_sort(order.begin(), order.end(),
                   [&](std::size_t i, std::size_t j) { return away[i] < away[j]; });
  Vec3 a = foot(bundle.lines[order[order.size() * 9 / 10]], bundle.point_m);
  Vec3 b = bundle.point_m - (a - bundle.point_m);
  std::pair<Bundle, Bundle> halves;
  for (int round = 0; round < 12; ++round) {
    halves.first.lines.clear();
    halves.second.lines.clear();
    for (const Escape& line : bundle.lines)
      (distance2_m2(line, a) <= distance2_m2(line, b) ? halves.first : halves.second)
          .lines.push_back(line);
    if (halves.first.lines.size() < 3 || halves.second.lines.size() < 3) return std::nullopt;
    halves.first.fit();
    halves.second.fit();
    a = halves.first.point_m;
    b = halves.second.point_m;
  }
  if (halves.first.error + halves.second.error > kTwoOpenings * bundle.error) return std::nullopt;
  return halves;
}

// Lines straight from an emitter meet at the emitter and do not locate the opening. They are added
// to the nearest bundle afterwards.
std::vector<Bundle> bundles_of(std::vector<Escape> escapes) {
  const auto straight = std::stable_partition(escapes.begin(), escapes.end(),
                                              [](const Escape& line) { return !line.direct; });
  std::vector<Escape> direct(straight, escapes.end());
  if (straight - escapes.begin() >= kTellingLines)
    escapes.erase(straight, escapes.end());
  else
    direct.clear();
  std::vector<Bundle> whole, waiting(1);
  waiting[0].lines = std::move(escapes);
  waiting[0].fit();
  while (!waiting.empty()) {
    Bundle bundle = std::move(waiting.back());
    waiting.pop_back();
    auto halves = whole.size() + waiting.size() + 2 <= kMaxOpenings ? in_two(bundle) : std::nullopt;
    if (halves) {
      waiting.push_back(std::move(halves->first));
      waiting.push_back(std::move(halves->second));
    } else {
      whole.push_back(std::move(bundle));
    }
  }
  for (const Escape& line : direct)
    std::min_element(whole.begin(), whole.end(), [&](const Bundle& a, const Bundle& b) {
      return distance2_m2(line, a.point_m) < distance2_m2(line, b.point_m);
    })->add_straight(line);
  return whole;
}

// Connected components of open edges: per edge, its representative.
std::vector<std::size_t> chains_of(const Mesh& mesh, std::span<const MeshEdge> edges) {
  DisjointSets<std::size_t> chains(edges.size());
  std::vector<std::size_t> last_at(mesh.vertices_m.size(), edges.size());
  for (std::size_t i = 0; i < edges.size(); ++i)
    for (const std::uint32_t vertex : edges[i].vertices) {
      if (last_at[vertex] < edges.size()) chains.join(i, last_at[vertex]);
      last_at[vertex] = i;
    }
  return chains.roots();
}

// Total length of the chain that covers most of the opening's border.
double edge_round_m(const Mesh& mesh, std::span<const MeshEdge> edges,
                    std::span<const std::size_t> chains, const LevelOpening& opening) {
  std::vector<double> near_m(edges.size(), 0), all_m(edges.size(), 0);
  std::size_t best = 0;
  for (std::size_t i = 0; i < edges.size(); ++i) {
    const Vec3 middle = 0.5 * (Vec3(mesh.vertices_m[edges[i].vertices[0]]) +
                               Vec3(mesh.vertices_m[edges[i].vertices[1]]));
    all_m[chains[i]] += edges[i].length_m;
    if (length(middle - opening.place_m) > 0.75 * opening.width_m + 0.5 * edges[i].length_m)
      continue;
    near_m[chains[i]] += edges[i].length_m;
    if (near_m[chains[i]] > near_m[best]) best = chains[i];
  }
  return edges.empty() || !(near_m[best] > 0) ? 0 : all_m[best];
}

// Returns whether the bundle locates an opening. Lines straight from one emitter all meet at that
// emitter, so bundles dominated by them do not.
bool tells_of_opening(const Bundle& bundle) {
  std::vector<std::array<double, 3>> origins;
  for (const Escape& line : bundle.lines)
    if (line.direct) origins.push_back({line.origin_m.x, line.origin_m.y, line.origin_m.z});
  std::sort(origins.begin(), origins.end());
  std::size_t together = 0, longest = 0;
  for (std::size_t i = 0; i < origins.size(); ++i) {
    together = i > 0 && origins[i] == origins[i - 1] ? together + 1 : 1;
    longest = std::max(longest, together);
  }
  return 2 * longest <= bundle.lines.size();
}

}  // namespace

LevelOpenings find_openings(const Scene& scene, const Level& level, std::span<const Vec3> starts_m,
                            std::span<const MeshEdge> free_edges) {
  LevelOpenings found;
  if (level.mesh.triangles.empty()) return found;
  const Walks walks = walk(scene, level, starts_m);
  found.rays = walks.rays;
  found.escaped = walks.escapes.size();
  if (walks.legs > 0) found.mean_free_path_m = walks.legs_m / static_cast<double>(walks.legs);
  if (walks.escapes.empty()) return found;

  const Boundsf bounds = bounds_of(level.mesh);
  const auto chains = chains_of(level.mesh, free_edges);
  for (const Bundle& bundle : bundles_of(walks.escapes)) {
    LevelOpening opening;
    opening.share = bundle.escaped / kOpeningWalks;
    opening.place_m = glm::clamp(bundle.point_m, Vec3(bounds.low_m), Vec3(bounds.high_m));
    opening.direction = bundle.flow / bundle.escaped;
    opening.squared_direction = bundle.squares / bundle.escaped;
    // Lines through a disc of radius R, distributed by Lambert's law, have a mean squared distance
    // of 3/8 R^2 from its centre.
    if (tells_of_opening(bundle)) {
      opening.width_m = 2 * std::sqrt(8.0 / 3 * bundle.error / bundle.power);
      opening.edge_length_m = edge_round_m(level.mesh, free_edges, chains, opening);
    }
    found.escaped_share += opening.share;
    found.openings.push_back(opening);
  }
  std::stable_sort(found.openings.begin(), found.openings.end(),
                   [](const auto& a, const auto& b) { return a.share > b.share; });
  return found;
}

double enclosed_volume_m3(const PreparedMesh& prepared) {
  const Mesh& mesh = prepared.mesh;
  if (mesh.triangles.empty() || !prepared.boundary_edges.empty() || prepared.split_edges > 0)
    return 0;
  const std::vector<std::uint32_t> sheets = sheets_of(mesh);

  // Six times the signed volume of each sheet, by the divergence theorem.
  std::vector<double> volumes(mesh.vertices_m.size(), 0);
  const Vec3 origin(mesh.vertices_m[0]);
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    const auto& corners = mesh.triangles[t];
    const auto at = [&](std::size_t c) { return Vec3(mesh.vertices_m[corners[c]]) - origin; };
    const double part = dot(at(0), cross(at(1), at(2)));
    volumes[sheets[corners[0]]] += prepared.turned[t] != 0 ? -part : part;
  }
  double largest = 0, all = 0;
  for (const double volume : volumes) {
    largest = std::max(largest, std::abs(volume));
    all += std::abs(volume);
  }
  return (largest - (all - largest)) / 6;
}

}  // namespace clamor
