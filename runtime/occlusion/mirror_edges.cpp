#include "runtime/occlusion/mirror_edges.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <optional>
#include <utility>

#include "runtime/occlusion/fresnel_visibility.h"
#include "runtime/occlusion/ways_around.h"

namespace clamor {

namespace {

// Edges on either side of the mirror, and those searched, which may be behind it.
constexpr std::size_t kMaxMirrorEdges = 12, kMaxSearched = 24;
constexpr double kReachInWaves = 1, kMinReach_m = 0.001;
constexpr double kOnPlane_m = 0.01;  // covers the rounding of corners in a bake file
constexpr double kOnPlaneSine = 0.05;
constexpr double kGrazing = 0.18;  // tangent of 10 degrees (edge_diffraction.cpp)
constexpr double kFade_m = 0.3;    // from a border, of sound over other edges
constexpr double kInto_m = 0.02;   // from a border to a point of its mirror

struct Plane {
  Vec3 middle_m, normal;  // unit, towards the source

  double height_m(const Vec3& point_m) const { return dot(point_m - middle_m, normal); }
  Vec3 mirrored(const Vec3& point_m) const { return point_m - 2 * height_m(point_m) * normal; }
};

// The edge with a face in the plane as its first, and air on the plane's positive side; nothing if
// it has none.
std::optional<DiffractingEdge> as_border(const DiffractingEdge& edge, const Plane& plane) {
  if (edge.is_sheet || std::abs(plane.height_m(Vec3(edge.from_m))) > kOnPlane_m ||
      std::abs(plane.height_m(Vec3(edge.to_m))) > kOnPlane_m)
    return std::nullopt;
  const Vec3 face(edge.face), air(edge.air);
  const auto end = static_cast<double>(edge.air_rad);
  const Vec3 second = std::cos(end) * face + std::sin(end) * air;
  const Vec3 before_second = std::sin(end) * face - std::cos(end) * air;
  DiffractingEdge border = edge;
  const auto is_mirror = [&](const Vec3& along_face, const Vec3& into_air) {
    border.face = Vec3f(along_face);
    border.air = Vec3f(into_air);
    return std::abs(dot(along_face, plane.normal)) < kOnPlaneSine &&
           dot(into_air, plane.normal) > 0;
  };
  return is_mirror(face, air) || is_mirror(second, before_second) ? std::optional(border)
                                                                  : std::nullopt;
}

// Share of the power that the mirror reflects close to its border.
Bands reflected_at(const OcclusionGeometry& geometry, const Plane& plane, bool is_part,
                   const DiffractingEdge& border, const Vec3& on_edge_m, std::uint64_t& rays) {
  const Vec3 inside_m = on_edge_m + kInto_m * Vec3(border.face), aside_m = kInto_m * plane.normal;
  ++rays;
  const auto hit = geometry.first_hit(Vec3f(inside_m + aside_m), Vec3f(inside_m - aside_m));
  return hit && hit->part.has_value() == is_part ? *hit->mirrored : Bands{};
}

double distance_to_line_m(const Vec3& point_m, const Vec3& a_m, const Vec3& b_m) {
  const Vec3 along_m = b_m - a_m;
  const double length2_m2 = dot(along_m, along_m);
  const double at =
      length2_m2 > 0 ? std::clamp(dot(point_m - a_m, along_m) / length2_m2, 0.0, 1.0) : 0;
  return length(point_m - a_m - at * along_m);
}

class EdgesOfMirror {
 public:
  EdgesOfMirror(const OcclusionGeometry& geometry, const PathEnd& image, const Vec3& place_m,
                bool is_hidden, double speed_of_sound_mps, std::uint64_t& rays)
      : is_hidden_(is_hidden),
        geometry_(geometry),
        plane_{0.5 * (image.real_m + image.seen_m), normalize(image.real_m - image.seen_m)},
        source_m_(image.real_m),
        image_m_(image.seen_m),
        place_m_(place_m),
        is_in_part_(image.is_in_part),
        speed_of_sound_mps_(speed_of_sound_mps),
        rays_(rays) {}

  MirrorEdges found() {
    const PathEnd listener(place_m_), source(source_m_);
    const PathEnd image(image_m_, source_m_, is_in_part_);
    const PathEnd mirrored_listener(plane_.mirrored(place_m_), place_m_, is_in_part_);
    // Behind the mirror, only sound from corners just before the listener is left.
    const double height_m = plane_.height_m(place_m_);
    if (height_m < -kGrazing * length(place_m_ - image_m_)) return std::move(made_);
    std::vector<EdgeBetween> after = search(image, listener);
    add_borders(after);
    if (height_m < 0) return std::move(made_);
    add_obstacles(image, listener, std::move(after), false);
    add_obstacles(source, mirrored_listener, search(source, mirrored_listener), true);
    return std::move(made_);
  }

 private:
  struct Heard {
    EdgeInAir border;
    double share;  // that counts, 0 if it is not heard
    Bands reflected;
  };

  // The nearest edges before the mirror, in the order of detours. The farther half of them fades
  // out.
  std::vector<EdgeBetween> search(const PathEnd& from, const PathEnd& to) {
    std::vector<EdgeBetween> found;
    reach_m_ = kReachInWaves * wavelength_m(0, speed_of_sound_mps_);
    geometry_.find_edges(from.seen_m, to.seen_m, kMaxSearched, reach_m_, found);
    std::ranges::sort(found, {}, &EdgeBetween::detour_m);
    if (found.size() >= kMaxSearched) reach_m_ = std::min(reach_m_, found.back().detour_m);
    std::erase_if(found, [this](const EdgeBetween& one) {
      return plane_.height_m(Vec3(one.edge.from_m)) < -kOnPlane_m &&
             plane_.height_m(Vec3(one.edge.to_m)) < -kOnPlane_m;
    });
    if (found.size() > kMaxMirrorEdges) {
      reach_m_ = std::min(reach_m_, found[kMaxMirrorEdges].detour_m);
      found.resize(kMaxMirrorEdges);
    }
    reach_m_ = std::max(reach_m_, kMinReach_m);
    return found;
  }

  // Takes the mirror's borders out of `found`.
  void add_borders(std::vector<EdgeBetween>& found) {
    for (const EdgeBetween& one : found)
      if (const auto border = as_border(one.edge, plane_)) edges_.push_back(*border);
    remove_borders(found);
    borders_.reserve(edges_.size());
    for (const DiffractingEdge& edge : edges_) add_border(edge);
    for (const Heard& first : borders_)
      for (const Heard& second : borders_)
        if (&first != &second) add_pair(first, second);
  }

  void add_border(const DiffractingEdge& edge) {
    const PointsAroundEdge points(edge, source_m_, place_m_);
    const double length_m = length(Vec3(edge.to_m) - Vec3(edge.from_m));
    const double z = std::clamp(points.apex_m(), 0.01 * length_m, 0.99 * length_m);
    const Bands reflected = reflected_at(geometry_, plane_, is_in_part_, edge,
                                         Vec3(edge.from_m) + z * Vec3(edge.along), rays_);
    if (reflected == Bands{}) return;
    Heard one{EdgeInAir(geometry_, edge, rays_), 0, reflected};
    const EdgeSound sound =
        sound_over_border(one.border, source_m_, place_m_, image_m_, speed_of_sound_mps_);
    if (sound.is_heard) one.share = add(sound, reflected, false);
    borders_.push_back(one);
  }

  void add_pair(const Heard& first, const Heard& second) {
    if (!(first.share * second.share > 0)) return;
    const Tones across = sound_across_sheet(first.border, second.border, source_m_, place_m_,
                                            image_m_, speed_of_sound_mps_);
    for (std::size_t i = 0; i < kTones; ++i)
      made_.across[i] += across[i] * first.share * second.share *
                         std::sqrt(static_cast<double>(first.reflected[i / kTonesPerBand]));
  }

  void remove_borders(std::vector<EdgeBetween>& found) const {
    std::erase_if(found, [this](const EdgeBetween& one) {
      return plane_.height_m(Vec3(one.edge.from_m)) < kOnPlane_m &&
             plane_.height_m(Vec3(one.edge.to_m)) < kOnPlane_m;
    });
  }

  void add_obstacles(const PathEnd& from, const PathEnd& to, std::vector<EdgeBetween> found,
                     bool is_before) {
    remove_borders(found);
    if (found.empty()) return;
    // Beyond the mirror, the edge's image is part of the other leg.
    for (EdgeBetween& one : found) {
      one.edge.goes_on_before = !is_on_plane(Vec3(one.edge.from_m));
      one.edge.goes_on_beyond = !is_on_plane(Vec3(one.edge.to_m));
    }
    const WaysAround ways(geometry_, from, to, speed_of_sound_mps_, std::move(found), is_hidden_,
                          rays_);
    for (EdgeSound sound : ways.sounds()) {
      const Vec3 mirrored_at_m =
          is_before ? crossing_m(sound.last_m, to.seen_m) : crossing_m(sound.first_m, from.seen_m);
      const double inside = share_inside(mirrored_at_m);
      for (auto& pressure : sound.pressure) pressure *= inside;
      add(sound, same_in_all_bands(1), is_before);
    }
  }

  bool is_on_plane(const Vec3& point_m) const {
    return std::abs(plane_.height_m(point_m)) < kOnPlane_m;
  }

  Vec3 crossing_m(const Vec3& a_m, const Vec3& b_m) const {
    const double a = plane_.height_m(a_m), b = plane_.height_m(b_m);
    return a == b ? a_m : a_m + a / (a - b) * (b_m - a_m);
  }

  // The sound over another edge fades towards the mirror's borders.
  double share_inside(const Vec3& mirrored_at_m) const {
    double distance_m = kFade_m;
    for (const Heard& one : borders_) {
      const DiffractingEdge& edge = one.border.edge();
      distance_m = std::min(distance_m,
                            distance_to_line_m(mirrored_at_m, Vec3(edge.from_m), Vec3(edge.to_m)));
    }
    return distance_m / kFade_m;
  }

  // Returns the share of the sound that counts, which is less where the detour is long.
  double add(EdgeSound sound, const Bands& reflected, bool is_before) {
    if (is_before) {
      sound.first_m = plane_.mirrored(sound.first_m);
      sound.last_m = plane_.mirrored(sound.last_m);
    }
    const double detour_m = sound.path_m - length(place_m_ - image_m_);
    const double share = std::clamp(2 - 2 * detour_m / reach_m_, 0.0, 1.0);
    for (std::size_t i = 0; i < kTones; ++i)
      sound.pressure[i] *= share * std::sqrt(static_cast<double>(reflected[i / kTonesPerBand]));
    const double distance_m = distance_to_line_m(sound.first_m, image_m_, place_m_);
    made_.nearness =
        std::max(made_.nearness, share * std::clamp(2 - distance_m / kNear_m, 0.0, 1.0));
    made_.sounds.push_back(sound);
    return share;
  }

  bool is_hidden_;
  const OcclusionGeometry& geometry_;
  Plane plane_;
  Vec3 source_m_, image_m_, place_m_;
  bool is_in_part_;
  double speed_of_sound_mps_;
  std::uint64_t& rays_;
  double reach_m_ = 0;                  // the longest detour that is heard
  std::vector<DiffractingEdge> edges_;  // the mirror's borders
  std::vector<Heard> borders_;
  MirrorEdges made_;
};

}  // namespace

MirrorEdges sound_over_mirror_edges(const OcclusionGeometry& geometry, const PathEnd& image,
                                    const Vec3& place_m, bool is_hidden, double speed_of_sound_mps,
                                    std::uint64_t& rays) {
  return EdgesOfMirror(geometry, image, place_m, is_hidden, speed_of_sound_mps, rays).found();
}

}  // namespace clamor
