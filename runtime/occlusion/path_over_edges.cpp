#include "runtime/occlusion/path_over_edges.h"

#include <algorithm>
#include <cmath>
#include <cstddef>

namespace clamor {

namespace {

constexpr int kMaxSteps = 30, kMaxHalvings = 10;
constexpr double kNear_m = 1e-7;     // of the least length
constexpr double kLeast_m = 1e-9;    // of a leg, which must not be 0
constexpr double kLeastTerm = 1e-9;  // of the second derivatives, where a leg goes along an edge

using Places = std::array<double, 2>;

class PathOverEdges {
 public:
  PathOverEdges(const EdgeInAir& first, const EdgeInAir& second, const Vec3& from_m,
                const Vec3& to_m)
      : edges_{&first, &second},
        along_{Vec3(first.edge().along), Vec3(second.edge().along)},
        from_m_(from_m),
        to_m_(to_m) {}

  Places clamped(const Places& z) const {
    return {std::clamp(z[0], 0.0, edges_[0]->length_m()),
            std::clamp(z[1], 0.0, edges_[1]->length_m())};
  }

  double length_m(const Places& z) const {
    const Vec3 a = edges_[0]->point_m(z[0]), b = edges_[1]->point_m(z[1]);
    return length(a - from_m_) + length(b - a) + length(to_m_ - b);
  }

  // The step to the least of the function's second-order expansion. A place at the end of its edge
  // stays there if the length falls beyond the end.
  Places step(const Places& z) const {
    const Vec3 a = edges_[0]->point_m(z[0]), b = edges_[1]->point_m(z[1]);
    const Leg before(a - from_m_), between(b - a), after(to_m_ - b);
    const Vec3 &u = along_[0], &v = along_[1];
    const double slope[] = {before.slope(u) - between.slope(u), between.slope(v) - after.slope(v)};
    double bend[] = {before.bend(u, u) + between.bend(u, u), between.bend(v, v) + after.bend(v, v)};
    for (double& one : bend) one = std::max(one, kLeastTerm);
    const double shared = -between.bend(u, v);
    const auto stays = [&](std::size_t i) {
      return (z[i] <= 0 && slope[i] > 0) || (z[i] >= edges_[i]->length_m() && slope[i] < 0);
    };
    if (stays(0)) return {0, stays(1) ? 0 : -slope[1] / bend[1]};
    if (stays(1)) return {-slope[0] / bend[0], 0};
    const double determinant =
        std::max(bend[0] * bend[1] - shared * shared, kLeastTerm * bend[0] * bend[1]);
    return {(shared * slope[1] - bend[1] * slope[0]) / determinant,
            (shared * slope[0] - bend[0] * slope[1]) / determinant};
  }

 private:
  // Derivatives of a leg's length as its end moves.
  struct Leg {
    explicit Leg(const Vec3& leg_m)
        : length_m(std::max(length(leg_m), kLeast_m)), along(leg_m / length_m) {}
    double slope(const Vec3& u) const { return dot(along, u); }
    double bend(const Vec3& u, const Vec3& v) const {
      return (dot(u, v) - dot(along, u) * dot(along, v)) / length_m;
    }
    double length_m;
    Vec3 along;
  };

  std::array<const EdgeInAir*, 2> edges_;
  std::array<Vec3, 2> along_;
  Vec3 from_m_, to_m_;
};

}  // namespace

std::array<double, 2> path_over_edges(const EdgeInAir& first, const EdgeInAir& second,
                                      const Vec3& from_m, const Vec3& to_m) {
  const PathOverEdges path(first, second, from_m, to_m);
  Places z = {0.5 * first.length_m(), 0.5 * second.length_m()};
  double shortest_m = path.length_m(z);
  for (int i = 0; i < kMaxSteps; ++i) {
    const Places step = path.step(z);
    double share = 1;
    Places next = z;
    double next_m = shortest_m;
    for (int halving = 0; halving < kMaxHalvings; ++halving, share *= 0.5) {
      const Places tried = path.clamped({z[0] + share * step[0], z[1] + share * step[1]});
      const double tried_m = path.length_m(tried);
      if (!(tried_m < shortest_m)) continue;
      next = tried;
      next_m = tried_m;
      break;
    }
    const double moved_m = std::max(std::abs(next[0] - z[0]), std::abs(next[1] - z[1]));
    z = next;
    shortest_m = next_m;
    if (moved_m < kNear_m) break;
  }
  return z;
}

}  // namespace clamor
