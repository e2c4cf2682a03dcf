#include "runtime/occlusion/mirror_edges.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <complex>
#include <cstddef>
#include <numbers>
#include <optional>
#include <span>
#include <utility>

#include "runtime/occlusion/diffraction_paths.h"
#include "runtime/occlusion/fresnel_visibility.h"

namespace clamor {

namespace {

using std::numbers::pi;

// Edges on either side of the mirror, and those searched, which may be behind it.
constexpr std::size_t kMaxMirrorEdges = 12, kMaxSearched = 24;
constexpr double kReachInWaves = 1, kMinReach_m = 0.001;
constexpr double kOnPlaneSine = 0.05;
constexpr double kGrazing = 0.18;  // tangent of 10 degrees (edge_diffraction.cpp)
constexpr double kFade_m = 0.3;    // from a border, of sound over other edges
constexpr double kInto_m = 0.02;   // from a border to a point of its mirror
// Nodes of each edge in the double integral across a sheet, and nodes in a wave: with fewer than
// the first there is no second order, from the second on there is all of it.
constexpr int kNodesAcross = 6;
constexpr double kFewNodes = 3, kManyNodes = 6;

// The edge with a face in the plane as its first, and air on the plane's positive side; nothing if
// it has none.
std::optional<DiffractingEdge> as_border(const DiffractingEdge& edge, const MirrorPlane& plane) {
  if (edge.is_sheet || !edge.is_in(plane)) return std::nullopt;
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

double distance_to_line_m(const Vec3& point_m, const Vec3& a_m, const Vec3& b_m) {
  const Vec3 along_m = b_m - a_m;
  const double length2_m2 = dot(along_m, along_m);
  const double at =
      length2_m2 > 0 ? std::clamp(dot(point_m - a_m, along_m) / length2_m2, 0.0, 1.0) : 0;
  return length(point_m - a_m - at * along_m);
}

// cosh(eta) of two points, as seen from a point of the edge.
double cosh_between(const DiffractingEdge& edge, const Vec3& on_edge_m, const Vec3& from_m,
                    const Vec3& to_m) {
  const PointsAroundEdge points(edge, from_m, to_m);
  const Vec3 along(edge.along);
  return (length(from_m - on_edge_m) * length(to_m - on_edge_m) +
          dot(on_edge_m - from_m, along) * dot(on_edge_m - to_m, along)) /
         std::max(points.r_from_m * points.r_to_m, 1e-12);
}

// beta of a sheet between a point at an angle and one on the face.
class BetaOnFace {
 public:
  explicit BetaOnFace(double angle_rad)
      : parts_{Part((pi + angle_rad) / 2), Part((pi - angle_rad) / 2)} {}

  double operator()(double cosh_eta) const {
    const double cosh_half = std::sqrt(std::max(cosh_eta + 1, 2.0) / 2);
    const auto of = [&](const Part& part) { return part.sine / (cosh_half - part.cosine + 1e-12); };
    return 2 * (of(parts_[0]) + of(parts_[1]));
  }

 private:
  struct Part {
    explicit Part(double phi) : sine(std::sin(phi)), cosine(std::cos(phi)) {}
    double sine, cosine;
  };
  std::array<Part, 2> parts_;
};

// Sound that goes along both sides of a sheet from one border to another, relative to the free
// field of a source's image. It matters where the sheet is no wider than the wave.
Tones sound_across_sheet(const EdgeInAir& first, const EdgeInAir& second, const Vec3& from_m,
                         const Vec3& to_m, const Vec3& image_m) {
  Tones pressure{};
  const double straight_m = length(to_m - image_m);
  const double steps_m[] = {first.length_m() / kNodesAcross, second.length_m() / kNodesAcross};
  const double step_m = std::max(steps_m[0], steps_m[1]);
  std::array<double, kTones> shares{};
  for (std::size_t i = 0; i < kTones; ++i) {
    const auto of_sheet = [&](const EdgeInAir& edge) {
      return edge.edge().air_rad > static_cast<float>(kSheet_rad) ? 1 : 1 - edge.share(i);
    };
    const double nodes = 2 * pi / first.wave_number(i) / step_m;
    shares[i] = std::clamp((nodes - kFewNodes) / (kManyNodes - kFewNodes), 0.0, 1.0) *
                of_sheet(first) * of_sheet(second);
  }
  if (!(std::ranges::max(shares) > 0)) return pressure;
  const double a = first.edge().angle_rad(from_m), b = second.edge().angle_rad(to_m);
  const BetaOnFace first_face(a), first_back(2 * pi - a), second_face(b), second_back(2 * pi - b);
  for (int i = 0; i < kNodesAcross; ++i)
    for (int j = 0; j < kNodesAcross; ++j) {
      const Vec3 p = first.point_m((i + 0.5) * steps_m[0]),
                 q = second.point_m((j + 0.5) * steps_m[1]);
      const double before_m = length(p - from_m), between_m = length(q - p),
                   after_m = length(to_m - q);
      // The other edge has to be at the face.
      if (!(dot(q - p, Vec3(first.edge().face)) > 0 && dot(p - q, Vec3(second.edge().face)) > 0))
        continue;
      const double cosh_1 = cosh_between(first.edge(), p, from_m, q),
                   cosh_2 = cosh_between(second.edge(), q, p, to_m);
      const double beta =
          first_face(cosh_1) * second_face(cosh_2) + first_back(cosh_1) * second_back(cosh_2);
      const double density = beta / (128 * pi * pi) * steps_m[0] * steps_m[1] * straight_m /
                             (before_m * between_m * after_m);
      const double detour_m = before_m + between_m + after_m - straight_m;
      for (std::size_t t = 0; t < kTonesPerBand; ++t) {
        std::complex<double> phase = std::polar(1.0, first.wave_number(t) * detour_m);
        for (std::size_t tone = t; tone < kTones && shares[tone] > 0; tone += kTonesPerBand) {
          pressure[tone] += shares[tone] * density * phase;
          phase *= phase;
        }
      }
    }
  return pressure;
}

class EdgesOfMirror {
 public:
  EdgesOfMirror(const OcclusionGeometry& geometry, const Reflection& reflection, bool is_hidden,
                double speed_of_sound_mps, std::uint64_t& rays)
      : is_hidden_(is_hidden),
        geometry_(geometry),
        reflection_(reflection),
        plane_(reflection.plane),
        source_m_(reflection.from.seen_m),
        image_m_(plane_.image_of(source_m_)),
        place_m_(reflection.to.seen_m),
        speed_of_sound_mps_(speed_of_sound_mps),
        rays_(rays) {}

  MirrorEdges found() {
    // Behind the mirror, only sound from corners just before the listener is left.
    const double height_m = plane_.height_m(place_m_);
    if (height_m < -kGrazing * length(place_m_ - image_m_) || !(plane_.height_m(source_m_) > 0))
      return std::move(made_);
    const bool in_part = reflection_.is_in_part;
    const PathEnd listener(place_m_), source(source_m_), image(image_m_, source_m_, in_part);
    std::vector<EdgeBetween> after = search(image, listener);
    if (height_m < 0 || !reflection_.is_only) {
      add_borders(after);
      return std::move(made_);
    }
    const double reach_after_m = reach_m_;
    const PathEnd mirrored_listener(plane_.image_of(place_m_), place_m_, in_part);
    std::vector<EdgeBetween> before = search(source, mirrored_listener);
    const double reach_before_m = reach_m_;
    // Borders are those of both searches, so that they are the same from either end.
    std::vector<EdgeBetween> both = after;
    both.insert(both.end(), before.begin(), before.end());
    reach_m_ = std::max(reach_after_m, reach_before_m);
    add_borders(both);
    reach_m_ = reach_after_m;
    add_obstacles(image, listener, std::move(after), false);
    reach_m_ = reach_before_m;
    add_obstacles(source, mirrored_listener, std::move(before), true);
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
    if (reflection_.is_only)
      geometry_.find_edges(from.seen_m, to.seen_m, kMaxSearched, reach_m_, found);
    else
      geometry_.find_edges_in(plane_, from.seen_m, to.seen_m, kMaxSearched, reach_m_, found);
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

  void add_borders(std::span<const EdgeBetween> found) {
    for (const EdgeBetween& one : found) {
      const auto border = as_border(one.edge, plane_);
      const auto is_same = [&](const DiffractingEdge& other) {
        return other.from_m == border->from_m && other.to_m == border->to_m &&
               other.face == border->face;
      };
      if (border && std::ranges::none_of(edges_, is_same)) edges_.push_back(*border);
    }
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
    const Vec3 inside_m = Vec3(edge.from_m) + z * Vec3(edge.along) + kInto_m * Vec3(edge.face);
    const Bands reflected =
        reflected_at(geometry_, plane_, inside_m, reflection_.is_in_part, rays_);
    if (reflected == Bands{}) return;
    Heard one{EdgeInAir(geometry_, edge, speed_of_sound_mps_, rays_), 0, reflected};
    const EdgeSound sound =
        sound_over_border(one.border, reflection_.from, reflection_.to, image_m_);
    if (sound.is_heard) one.share = add(sound, reflected, false);
    borders_.push_back(one);
  }

  void add_pair(const Heard& first, const Heard& second) {
    if (!(first.share * second.share > 0)) return;
    const Tones across =
        sound_across_sheet(first.border, second.border, source_m_, place_m_, image_m_);
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
      one.edge.goes_on_before = std::abs(plane_.height_m(Vec3(one.edge.from_m))) >= kOnPlane_m;
      one.edge.goes_on_beyond = std::abs(plane_.height_m(Vec3(one.edge.to_m))) >= kOnPlane_m;
    }
    const DiffractionPaths paths(geometry_, from, to, speed_of_sound_mps_, std::move(found),
                                 is_hidden_, rays_);
    for (EdgeSound sound : paths.sounds()) {
      const Vec3 mirrored_at_m = is_before ? plane_.crossing_m(sound.last_m, to.seen_m)
                                           : plane_.crossing_m(sound.first_m, from.seen_m);
      const double inside = share_inside(mirrored_at_m);
      for (auto& pressure : sound.pressure) pressure *= inside;
      add(sound, same_in_all_bands(1), is_before);
    }
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
      sound.first_m = plane_.image_of(sound.first_m);
      sound.last_m = plane_.image_of(sound.last_m);
    }
    const double detour_m = sound.path_m - length(place_m_ - image_m_);
    const double share = std::clamp(2 - 2 * detour_m / reach_m_, 0.0, 1.0);
    for (std::size_t i = 0; i < kTones; ++i)
      sound.pressure[i] *= share * std::sqrt(static_cast<double>(reflected[i / kTonesPerBand]));
    const double distance_m = distance_to_line_m(sound.first_m, image_m_, place_m_);
    made_.nearness =
        std::max(made_.nearness, share * std::clamp(2 - distance_m / kBlendRadius_m, 0.0, 1.0));
    made_.sounds.push_back(sound);
    return share;
  }

  bool is_hidden_;
  const OcclusionGeometry& geometry_;
  const Reflection& reflection_;
  const MirrorPlane& plane_;
  Vec3 source_m_, image_m_, place_m_;
  double speed_of_sound_mps_;
  std::uint64_t& rays_;
  double reach_m_ = 0;                  // the longest detour that is heard
  std::vector<DiffractingEdge> edges_;  // the mirror's borders
  std::vector<Heard> borders_;
  MirrorEdges made_;
};

}  // namespace

Bands reflected_at(const OcclusionGeometry& geometry, const MirrorPlane& plane, const Vec3& point_m,
                   bool is_in_part, std::uint64_t& rays) {
  const Vec3 aside_m = kInto_m * plane.normal;
  ++rays;
  const auto hit = geometry.first_hit(Vec3f(point_m + aside_m), Vec3f(point_m - aside_m));
  return hit && hit->part.has_value() == is_in_part ? *hit->mirrored : Bands{};
}

MirrorEdges sound_over_mirror_edges(const OcclusionGeometry& geometry, const Reflection& reflection,
                                    bool is_hidden, double speed_of_sound_mps,
                                    std::uint64_t& rays) {
  return EdgesOfMirror(geometry, reflection, is_hidden, speed_of_sound_mps, rays).found();
}

}  // namespace clamor
