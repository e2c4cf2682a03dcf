#include "bake/mesh/mesh_simplification.h"

#include <algorithm>
#include <cassert>
#include <queue>
#include <utility>
#include <vector>

#include "bake/mesh/collapse_distance.h"
#include "bake/mesh/collapsible_surface.h"

namespace clamor {

namespace {

// Vertices with more triangles stay, because the cost of a fan is quadratic in their number.
constexpr std::size_t kMaxRemovable = 32;

// The triangles around a vertex on one side of its constraint lines, or all of them.
struct Fan {
  std::vector<Vec3> ring;
  std::vector<Face> faces;
  bool closed = false;
};

struct Candidate {
  double error;
  std::uint32_t vertex, round;
  // std::priority_queue returns the largest element first.
  bool operator<(const Candidate& other) const {
    return error != other.error ? error > other.error : vertex > other.vertex;
  }
};

class Simplifier {
 public:
  explicit Simplifier(CollapsibleSurface& lined) : lined_(lined), surface_(lined.mesh()) {}

  void run() {
    for (const auto vertex : surface_.vertices()) enqueue(vertex);
    while (!queue_.empty()) {
      const Candidate next = queue_.top();
      queue_.pop();
      const Vertex vertex(static_cast<int>(next.vertex));
      if (surface_.status(vertex).deleted() || surface_.data(vertex).round != next.round) continue;
      remove(vertex);
    }
  }

 private:
  Vec3 at(Vertex vertex) const { return lined_.at(vertex); }
  bool is_line(Edge edge) const { return lined_.is_line(edge); }

  double error_of(Halfedge halfedge) const {
    const Vertex from = surface_.from_vertex_handle(halfedge),
                 to = surface_.to_vertex_handle(halfedge);
    return std::max(0.0, surface_.data(from).error.at(at(to)) + surface_.data(to).error.at(at(to)));
  }

  // Collapse targets that the constraint lines allow, lowest error first.
  const std::vector<std::pair<double, Halfedge>>& targets_of(Vertex vertex) {
    targets_.clear();
    std::size_t lines = 0, spokes = 0;
    for (const auto halfedge : surface_.voh_range(vertex)) {
      ++spokes;
      lines += is_line(surface_.edge_handle(halfedge));
    }
    if (spokes < 2 || spokes > kMaxRemovable || (lines != 0 && lines != 2)) return targets_;
    for (const auto halfedge : surface_.voh_range(vertex))
      if (lines == 0 || is_line(surface_.edge_handle(halfedge)))
        targets_.emplace_back(error_of(halfedge), halfedge);
    std::sort(targets_.begin(), targets_.end(), [this](const auto& a, const auto& b) {
      return a.first != b.first ? a.first < b.first
                                : surface_.to_vertex_handle(a.second).idx() <
                                      surface_.to_vertex_handle(b.second).idx();
    });
    return targets_;
  }

  void enqueue(Vertex vertex) {
    const std::uint32_t round = ++surface_.data(vertex).round;
    const auto& targets = targets_of(vertex);
    if (!targets.empty())
      queue_.push({targets.front().first, static_cast<std::uint32_t>(vertex.idx()), round});
  }

  // The fans around a half-edge's start, each beginning with the half-edge's end: one for an
  // interior vertex, or one on each side of its constraint lines.
  void find_fans(Halfedge halfedge) {
    fans_.clear();
    if (!is_line(surface_.edge_handle(halfedge))) {
      Fan all;
      all.closed = true;
      Halfedge spoke = halfedge;
      do {
        all.ring.push_back(at(surface_.to_vertex_handle(spoke)));
        all.faces.push_back(surface_.face_handle(spoke));
        spoke = surface_.ccw_rotated_halfedge_handle(spoke);
      } while (spoke != halfedge);
      fans_.push_back(std::move(all));
      return;
    }
    for (const bool left : {true, false}) {
      Fan fan;
      Halfedge spoke = halfedge;
      while (true) {
        fan.ring.push_back(at(surface_.to_vertex_handle(spoke)));
        if (fan.ring.size() > 1 && is_line(surface_.edge_handle(spoke))) break;
        const Halfedge side = left ? spoke : surface_.opposite_halfedge_handle(spoke);
        if (surface_.is_boundary(side)) break;
        fan.faces.push_back(surface_.face_handle(side));
        spoke = left ? surface_.ccw_rotated_halfedge_handle(spoke)
                     : surface_.cw_rotated_halfedge_handle(spoke);
      }
      if (!fan.faces.empty()) fans_.push_back(std::move(fan));
    }
  }

  // Returns whether the collapse preserves topology, constraint lines and tolerance. On success
  // moved_ holds the new bound of each fan.
  bool may_collapse(Halfedge halfedge) {
    if (!surface_.is_collapse_ok(halfedge)) return false;
    // Two constraint lines must not coincide.
    for (const Halfedge side : {halfedge, surface_.opposite_halfedge_handle(halfedge)}) {
      if (surface_.is_boundary(side)) continue;
      const Halfedge next = surface_.next_halfedge_handle(side),
                     last = surface_.next_halfedge_handle(next);
      if (is_line(surface_.edge_handle(next)) && is_line(surface_.edge_handle(last))) return false;
    }
    find_fans(halfedge);
    moved_.clear();
    const Vec3 centre = at(surface_.from_vertex_handle(halfedge));
    for (const Fan& fan : fans_) {
      const auto distance_m = collapse_distance_m(centre, fan.ring, fan.closed, lined_.weld_m());
      if (!distance_m) return false;
      double moved_m = 0, may_m = lined_.tolerance_m();
      for (const Face face : fan.faces) {
        moved_m = std::max(moved_m, surface_.data(face).moved_m);
        may_m = std::min(may_m, surface_.data(face).may_m);
      }
      moved_m += *distance_m;
      if (moved_m > may_m) return false;
      moved_.emplace_back(moved_m, may_m);
    }
    return true;
  }

  void remove(Vertex vertex) {
    targets_of(vertex);
    for (std::size_t i = 0; i < targets_.size(); ++i) {
      const Halfedge halfedge = targets_[i].second;
      if (!may_collapse(halfedge)) continue;
      collapse(halfedge);
      return;
    }
  }

  void collapse(Halfedge halfedge) {
    const Vertex from = surface_.from_vertex_handle(halfedge),
                 to = surface_.to_vertex_handle(halfedge);
    for (std::size_t i = 0; i < fans_.size(); ++i)
      for (const Face face : fans_[i].faces) {
        surface_.data(face).moved_m = moved_[i].first;
        surface_.data(face).may_m = moved_[i].second;
      }
    // A removed face leaves one of its two sides, which is a constraint line if either was.
    std::vector<Vertex> lines;
    for (const Halfedge side : {halfedge, surface_.opposite_halfedge_handle(halfedge)}) {
      if (surface_.is_boundary(side)) continue;
      const Halfedge next = surface_.next_halfedge_handle(side),
                     last = surface_.next_halfedge_handle(next);
      if (is_line(surface_.edge_handle(next)) || is_line(surface_.edge_handle(last)))
        lines.push_back(surface_.to_vertex_handle(next));
    }
    surface_.data(to).error.add(surface_.data(from).error);
    surface_.collapse(halfedge);
    for (const Vertex other : lines) {
      const Halfedge left = surface_.find_halfedge(to, other);
      surface_.status(surface_.edge_handle(left)).set_feature(true);
    }
    enqueue(to);
    for (const auto neighbour : surface_.vv_range(to)) enqueue(neighbour);
  }

  CollapsibleSurface& lined_;
  Surface& surface_;  // of lined_
  std::priority_queue<Candidate> queue_;
  std::vector<std::pair<double, Halfedge>> targets_;
  std::vector<Fan> fans_;
  std::vector<std::pair<double, double>> moved_;  // per fan: moved_m, may_m
};

}  // namespace

Simplification simplify(const PreparedMesh& prepared, double tolerance_m) {
  assert(tolerance_m > 0);
  CollapsibleSurface surface(prepared, tolerance_m);
  Simplifier(surface).run();
  return surface.remaining();
}

}  // namespace clamor
