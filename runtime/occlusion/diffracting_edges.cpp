#include "runtime/occlusion/diffracting_edges.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <optional>
#include <span>
#include <utility>

#include "common/maths.h"
#include "runtime/occlusion/mirror_plane.h"
#include "runtime/occlusion/place_order.h"

namespace clamor {

namespace {

using std::numbers::pi;
constexpr double kMinLength_m = 0.02;
constexpr double kSameLine_m = 0.0015;  // corners are rounded to millimetres
// Air of less than this beyond 180 degrees is that of a plane whose corners were rounded.
constexpr double kMinBend_rad = 5 * pi / 180;
// Corners of walls have an air of about 270 degrees, and ends of walls are at most so wide.
constexpr double kCornerLow_rad = 1.4 * pi, kCornerHigh_rad = 1.6 * pi, kMaxWidth_m = 1;
constexpr float kWide_m = std::numeric_limits<float>::infinity();
constexpr float kPost = 2;  // a post is at most so much wider one way than the other
constexpr float kParallel = 0.999f;
constexpr double kSameFace = 0.98;
constexpr double kOnFace_rad = 0.01;  // from a face to points on it, as rounded

// A side of a face, with its ends in order.
struct Side {
  Vec3f from_m{}, to_m{}, corner_m{};
};

bool is_side_before(const Side& a, const Side& b) {
  if (a.from_m != b.from_m) return comes_before(a.from_m, b.from_m);
  return a.to_m != b.to_m ? comes_before(a.to_m, b.to_m) : comes_before(a.corner_m, b.corner_m);
}

Side side_between(Vec3f a, Vec3f b, const Vec3f& corner_m) {
  if (comes_before(b, a)) std::swap(a, b);
  return {a, b, corner_m};
}

// The sides of faces that are one edge.
using FacesAtEdge = std::span<const Side>;

// Sorts the sides and calls act(faces) for each edge, in order.
template <class Act>
void for_edges(std::vector<Side>& sides, const Act& act) {
  std::sort(sides.begin(), sides.end(), is_side_before);
  for (std::size_t first = 0, end = 0; first < sides.size(); first = end) {
    while (end < sides.size() && sides[end].from_m == sides[first].from_m &&
           sides[end].to_m == sides[first].to_m)
      ++end;
    act(FacesAtEdge(&sides[first], end - first));
  }
}

std::vector<Side> sides_of(const Mesh& mesh) {
  std::vector<Side> sides;
  sides.reserve(3 * mesh.triangles.size());
  for (const auto& triangle : mesh.triangles)
    for (std::size_t c = 0; c < 3; ++c)
      sides.push_back(side_between(mesh.vertices_m[triangle[c]],
                                   mesh.vertices_m[triangle[(c + 1) % 3]],
                                   mesh.vertices_m[triangle[(c + 2) % 3]]));
  return sides;
}

// Returns whether a segment may come as near to the box as points on it lie to its line.
bool is_near_segment(const Boundsf& box, const Vec3& middle_m, const Vec3& along, double half_m) {
  const Vec3 centre_m = 0.5 * (Vec3(box.low_m) + Vec3(box.high_m));
  const Vec3 extent_m = 0.5 * (Vec3(box.high_m) - Vec3(box.low_m)) + Vec3(kSameLine_m);
  const Vec3 away_m = middle_m - centre_m;
  for (glm::length_t axis = 0; axis < 3; ++axis)
    if (std::abs(away_m[axis]) > extent_m[axis] + half_m * std::abs(along[axis])) return false;
  const Vec3 across_m = glm::abs(cross(along, away_m)), reach = glm::abs(along);
  return across_m.x <= extent_m.y * reach.z + extent_m.z * reach.y &&
         across_m.y <= extent_m.x * reach.z + extent_m.z * reach.x &&
         across_m.z <= extent_m.x * reach.y + extent_m.y * reach.x;
}

// The edge, if it diffracts. `angles` is working memory.
std::optional<DiffractingEdge> edge_of(FacesAtEdge faces, std::vector<double>& angles) {
  const Vec3 from_m(faces[0].from_m), to_m(faces[0].to_m);
  const double length_m = length(to_m - from_m);
  if (!(length_m >= kMinLength_m)) return std::nullopt;
  const Vec3 along = (to_m - from_m) / length_m;
  const Basis basis = basis_around(along);
  angles.clear();
  for (const Side& face : faces) {
    const Vec3 into_m = Vec3(face.corner_m) - from_m;
    const double x = dot(into_m, basis.tangent), y = dot(into_m, basis.bitangent);
    if (x != 0 || y != 0) angles.push_back(std::atan2(y, x));
  }
  if (angles.empty()) return std::nullopt;
  std::sort(angles.begin(), angles.end());
  double widest = 0, start = 0;
  for (std::size_t i = 0; i < angles.size(); ++i) {
    const double next = i + 1 < angles.size() ? angles[i + 1] : angles[0] + 2 * pi;
    if (next - angles[i] <= widest) continue;
    widest = next - angles[i];
    start = angles[i];
  }
  if (widest < pi + kMinBend_rad) return std::nullopt;
  const Vec3 face = std::cos(start) * basis.tangent + std::sin(start) * basis.bitangent;
  const Vec3 air = std::cos(start) * basis.bitangent - std::sin(start) * basis.tangent;
  return DiffractingEdge{faces[0].from_m, faces[0].to_m, Vec3f(along),
                         Vec3f(face),     Vec3f(air),    static_cast<float>(widest)};
}

// Divides edges where the end of another lies on them: a wall whose side is longer than the jamb
// that joins it makes a corner with the jamb.
std::vector<Side> divided(const std::vector<FacesAtEdge>& edges) {
  std::vector<Vec3f> ends_m;
  for (const FacesAtEdge& faces : edges)
    ends_m.insert(ends_m.end(), {faces[0].from_m, faces[0].to_m});
  std::sort(ends_m.begin(), ends_m.end(), comes_before<float>);
  ends_m.erase(std::unique(ends_m.begin(), ends_m.end()), ends_m.end());
  std::vector<Boundsf> points;
  for (const Vec3f& end_m : ends_m) points.push_back({end_m, end_m});
  const BoxTree tree(points);
  std::vector<Side> sides;
  std::vector<std::pair<double, Vec3f>> cuts;  // by distance from the edge's first end
  for (const FacesAtEdge& faces : edges) {
    const Vec3 from_m(faces[0].from_m), to_m(faces[0].to_m), middle_m = 0.5 * (from_m + to_m);
    const double length_m = length(to_m - from_m);
    const Vec3 along = (to_m - from_m) / length_m;
    cuts.assign({{0, faces[0].from_m}, {length_m, faces[0].to_m}});
    const Boundsf around{Vec3f(glm::min(from_m, to_m) - 2 * kSameLine_m),
                         Vec3f(glm::max(from_m, to_m) + 2 * kSameLine_m)};
    tree.find(
        std::span(&around, 1),
        [&](const Boundsf& box) { return is_near_segment(box, middle_m, along, 0.5 * length_m); },
        [&](std::size_t end) {
          const Vec3 to_end_m = Vec3(ends_m[end]) - from_m;
          const double z = dot(to_end_m, along);
          if (z > kSameLine_m && z < length_m - kSameLine_m &&
              length(to_end_m - z * along) < kSameLine_m)
            cuts.emplace_back(z, ends_m[end]);
        });
    std::sort(cuts.begin(), cuts.end(),
              [](const auto& a, const auto& b) { return a.first < b.first; });
    for (std::size_t c = 1; c < cuts.size(); ++c)
      for (const Side& face : faces)
        sides.push_back(side_between(cuts[c - 1].second, cuts[c].second, face.corner_m));
  }
  return sides;
}

// The shortest path from one point over the edge to the other.
double shortest_path_m(const DiffractingEdge& edge, const Vec3& from_m, const Vec3& to_m) {
  const PointsAroundEdge points(edge, from_m, to_m);
  const double end_m = length(Vec3(edge.to_m) - Vec3(edge.from_m));
  return points.path_m(std::clamp(points.apex_m(), 0.0, end_m));
}

// A lower bound of that length, which is less by no more than rounding and takes a fraction of the
// time.
double min_path_m(const DiffractingEdge& edge, const Vec3& from_m, const Vec3& to_m) {
  constexpr double kRounding = 1e-12;
  const PointsAroundEdge points(edge, from_m, to_m);
  const double end_m = length(Vec3(edge.to_m) - Vec3(edge.from_m));
  const double z = std::clamp(points.apex_m(), 0.0, end_m);
  const auto leg_m = [](double r_m, double along_m) {
    return std::sqrt(r_m * r_m + along_m * along_m);
  };
  return (1 - kRounding) *
         (leg_m(points.r_from_m, z - points.z_from_m) + leg_m(points.r_to_m, z - points.z_to_m));
}

bool is_corner(const DiffractingEdge& edge) {
  return edge.air_rad > kCornerLow_rad && edge.air_rad < kCornerHigh_rad;
}

Vec3 along_face(const DiffractingEdge& edge, std::size_t which) {
  if (which == 0) return Vec3(edge.face);
  const auto angle = static_cast<double>(edge.air_rad);
  return std::cos(angle) * Vec3(edge.face) + std::sin(angle) * Vec3(edge.air);
}

// Directions along both faces of an edge, away from it.
using AlongFaces = std::array<Vec3, 2>;
AlongFaces along_faces(const DiffractingEdge& edge) {
  return {along_face(edge, 0), along_face(edge, 1)};
}

// Width of a face of one edge that ends at the other, if they are the two edges of the end of a
// wall; infinite otherwise.
float width_between_m(const DiffractingEdge& edge, const AlongFaces& faces, std::size_t face,
                      const DiffractingEdge& other) {
  if (std::abs(glm::dot(edge.along, other.along)) < kParallel) return kWide_m;
  const Vec3 along(edge.along), across = faces[face], into = faces[1 - face];
  const Vec3 start_m = Vec3(other.from_m) - Vec3(edge.from_m),
             end_m = Vec3(other.to_m) - Vec3(edge.from_m);
  const double width_m = dot(start_m, across);
  if (!(width_m > kSameLine_m && width_m < kMaxWidth_m)) return kWide_m;
  if (length(start_m - width_m * across - dot(start_m, along) * along) > 2 * kSameLine_m)
    return kWide_m;
  const double length_m = length(Vec3(edge.to_m) - Vec3(edge.from_m));
  const double low = std::min(dot(start_m, along), dot(end_m, along));
  const double high = std::max(dot(start_m, along), dot(end_m, along));
  const double longer_m = std::max(length_m, high - low);
  if (std::min(high, length_m) - std::max(low, 0.0) < 0.5 * longer_m) return kWide_m;
  const AlongFaces of_other = along_faces(other);
  for (std::size_t k = 0; k < 2; ++k)
    if (dot(of_other[k], across) < -kSameFace && dot(of_other[1 - k], into) > kSameFace)
      return static_cast<float>(width_m);
  return kWide_m;
}

// Bounds of a face, if it is the end of a wall, and of the other edge of that end: they overlap by
// half of the longer one, so that is at most twice as long, and nearly parallel.
Boundsf beside_m(const DiffractingEdge& edge, const Vec3& along_face) {
  const Vec3f across_m(kMaxWidth_m * along_face);
  const float around_m =
      static_cast<float>(2 * kSameLine_m) + 0.1f * glm::length(edge.to_m - edge.from_m);
  Boundsf beside;
  for (const Vec3f& end_m : {edge.from_m, edge.to_m}) {
    beside.add(end_m);
    beside.add(end_m + across_m);
  }
  return {beside.low_m - around_m, beside.high_m + around_m};
}

// The border of a sheet in the middle of a narrow face.
DiffractingEdge sheet_between(const DiffractingEdge& edge, std::size_t face, float width_m,
                              bool is_post) {
  DiffractingEdge sheet = edge;
  const Vec3 along(edge.along), into = along_face(edge, 1 - face);
  const Vec3 across = normalize(along_face(edge, face) - dot(along_face(edge, face), into) * into);
  const Vec3f to_middle_m(0.5 * static_cast<double>(width_m) * across);
  sheet.from_m += to_middle_m;
  sheet.to_m += to_middle_m;
  sheet.face = Vec3f(into);
  sheet.air = Vec3f(across);
  sheet.air_rad = static_cast<float>(2 * pi);
  sheet.width_m = width_m;
  sheet.is_sheet = true;
  sheet.is_post = is_post;
  return sheet;
}

std::vector<Boundsf> boxes_of(const std::vector<DiffractingEdge>& edges) {
  std::vector<Boundsf> boxes;
  for (const DiffractingEdge& edge : edges)
    boxes.push_back({glm::min(edge.from_m, edge.to_m), glm::max(edge.from_m, edge.to_m)});
  return boxes;
}

// Returns whether the edge may bend sound from one point to the other, alone or after another edge.
bool may_bend(const DiffractingEdge& edge, const Vec3& from_m, const Vec3& to_m) {
  return edge.is_between(from_m, to_m) && (edge.is_in_air(from_m) || edge.is_in_air(to_m));
}

// Returns whether a point of the box may lie in the plane.
bool touches(const MirrorPlane& plane, const Boundsf& box) {
  const Vec3 low_m(box.low_m), high_m(box.high_m);
  return std::abs(plane.height_m(0.5 * (low_m + high_m))) <=
         0.5 * dot(glm::abs(plane.normal), high_m - low_m) + kOnPlane_m;
}

}  // namespace

bool DiffractingEdge::is_in(const MirrorPlane& plane) const {
  return std::abs(plane.height_m(Vec3(from_m))) < kOnPlane_m &&
         std::abs(plane.height_m(Vec3(to_m))) < kOnPlane_m;
}

double DiffractingEdge::angle_rad(const Vec3& point_m) const {
  const Vec3 to_point_m = point_m - Vec3(from_m);
  const double angle = std::atan2(dot(to_point_m, Vec3(air)), dot(to_point_m, Vec3(face)));
  return angle < 0 ? angle + 2 * pi : angle;
}

double DiffractingEdge::angle_in_air_rad(const Vec3& point_m) const {
  const double angle = angle_rad(point_m), end = static_cast<double>(air_rad);
  if (angle <= end) return angle;
  return angle - end < 2 * pi - angle ? end : 0;
}

bool DiffractingEdge::is_in_air(const Vec3& point_m) const {
  const double angle = angle_rad(point_m);
  return angle <= static_cast<double>(air_rad) + kTie_rad || angle > 2 * pi - kTie_rad;
}

bool DiffractingEdge::is_on_face(const Vec3& point_m) const {
  const double angle = angle_rad(point_m);
  return std::abs(angle) < kOnFace_rad || 2 * pi - angle < kOnFace_rad ||
         std::abs(angle - static_cast<double>(air_rad)) < kOnFace_rad;
}

// Compares the sides of both planes without angles, because searches ask this of thousands of
// edges.
bool DiffractingEdge::is_between(const Vec3& a_m, const Vec3& b_m) const {
  struct Sides {
    double along_face, into_air;
    bool is_before_first() const { return into_air > 0 || (into_air == 0 && along_face >= 0); }
  };
  const auto sides = [this](const Vec3& point_m) {
    const Vec3 to_point_m = point_m - Vec3(from_m);
    return Sides{dot(to_point_m, Vec3(face)), dot(to_point_m, Vec3(air))};
  };
  const Sides a = sides(a_m), b = sides(b_m);
  if (a.is_before_first() != b.is_before_first()) return true;
  const double sine = std::sin(static_cast<double>(air_rad)),
               cosine = std::cos(static_cast<double>(air_rad));
  const auto is_before_second = [&](const Sides& point) {
    return sine * point.along_face - cosine * point.into_air >= 0;
  };
  return is_before_second(a) != is_before_second(b);
}

PointsAroundEdge::PointsAroundEdge(const DiffractingEdge& edge, const Vec3& from_m,
                                   const Vec3& to_m)
    : z_from_m(dot(from_m - Vec3(edge.from_m), Vec3(edge.along))),
      z_to_m(dot(to_m - Vec3(edge.from_m), Vec3(edge.along))),
      r_from_m(length(from_m - Vec3(edge.from_m) - z_from_m * Vec3(edge.along))),
      r_to_m(length(to_m - Vec3(edge.from_m) - z_to_m * Vec3(edge.along))) {}

double PointsAroundEdge::apex_m() const {
  const double sum_m = r_from_m + r_to_m;
  return sum_m > 0 ? (z_from_m * r_to_m + z_to_m * r_from_m) / sum_m : z_from_m;
}

double PointsAroundEdge::path_m(double z) const {
  return hypotenuse(r_from_m, z - z_from_m) + hypotenuse(r_to_m, z - z_to_m);
}

DiffractingEdges::DiffractingEdges(const Mesh& mesh) {
  std::vector<double> angles;
  std::vector<Side> sides = sides_of(mesh);
  std::vector<FacesAtEdge> sharp;
  for_edges(sides, [&](FacesAtEdge faces) {
    if (edge_of(faces, angles)) sharp.push_back(faces);
  });
  std::vector<Side> parts = divided(sharp);
  for_edges(parts, [&](FacesAtEdge faces) {
    if (const auto edge = edge_of(faces, angles)) edges_.push_back(*edge);
  });
  tree_ = BoxTree(boxes_of(edges_));
  const std::size_t corners = edges_.size();
  add_ends_of_walls();
  if (edges_.size() > corners) tree_ = BoxTree(boxes_of(edges_));
}

void DiffractingEdges::add_ends_of_walls() {
  struct End {
    std::size_t edge, face, other;
    float width_m;
  };
  std::vector<End> ends;
  for (std::size_t e = 0; e < edges_.size(); ++e) {
    DiffractingEdge& edge = edges_[e];
    if (!is_corner(edge)) continue;
    const AlongFaces along = along_faces(edge);
    const std::array beside{beside_m(edge, along[0]), beside_m(edge, along[1])};
    const auto any_box = [](const Boundsf&) { return true; };
    tree_.find(beside, any_box, [&](std::size_t other) {
      if (other <= e || !is_corner(edges_[other])) return;
      for (std::size_t face = 0; face < 2; ++face) {
        const float width_m = width_between_m(edge, along, face, edges_[other]);
        if (!(width_m < kWide_m)) continue;
        ends.push_back({e, face, other, width_m});
        for (const std::size_t corner : {e, other})
          edges_[corner].width_m = std::min(edges_[corner].width_m, width_m);
      }
    });
  }
  // The wide faces of a wall are no ends.
  std::erase_if(ends, [this](const End& end) {
    return end.width_m > kPost * std::min(edges_[end.edge].width_m, edges_[end.other].width_m);
  });
  std::vector<int> faces(edges_.size());  // that are ends, by edge
  for (const End& end : ends)
    for (const std::size_t corner : {end.edge, end.other}) ++faces[corner];
  for (const End& end : ends)
    edges_.push_back(sheet_between(edges_[end.edge], end.face, end.width_m, faces[end.edge] > 1));
}

void DiffractingEdges::find_nearest(const Vec3& from_m, const Vec3& to_m, std::size_t count,
                                    double longest_m, std::vector<EdgeBetween>& found,
                                    const MirrorPlane* plane) const {
  if (count == 0) return;
  constexpr double kNever_m = std::numeric_limits<double>::infinity();
  const double straight_m = length(to_m - from_m);
  const std::size_t end = found.size() + count;
  tree_.find_nearest(
      straight_m + longest_m,
      [&](const Boundsf& box) {
        return plane != nullptr && !touches(*plane, box) ? kNever_m : min_path_m(from_m, to_m, box);
      },
      [&](std::size_t edge) {
        return plane != nullptr && !edges_[edge].is_in(*plane)
                   ? kNever_m
                   : min_path_m(edges_[edge], from_m, to_m);
      },
      [&](std::size_t edge) {
        return may_bend(edges_[edge], from_m, to_m)
                   ? std::optional(shortest_path_m(edges_[edge], from_m, to_m))
                   : std::nullopt;
      },
      [&](std::size_t edge, double path_m) {
        found.push_back({path_m - straight_m, edges_[edge]});
        return found.size() < end;
      });
}

}  // namespace clamor
