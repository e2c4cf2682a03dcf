#include "runtime/occlusion/edge_diffraction.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>
#include <vector>

#include "common/maths.h"
#include "runtime/occlusion/path_over_edges.h"

namespace clamor {

namespace {

using Complex = std::complex<double>;
using std::numbers::pi;

// Nodes of the integral are evenly spaced in t, z = z_apex + scale sinh(t).
constexpr double kStep = 0.2, kZoneFraction = 0.5;
constexpr int kMaxNodes = 400;
constexpr double kSlowTurn_rad = 0.3;  // of the phase between nodes
// Points of the edge that rays look at, in steps of t.
constexpr double kSightStep = 0.8;
constexpr int kMinSights = 6, kMaxSights = 40, kBisections = 6;
constexpr double kMinAngle_rad = 1e-4;  // to the boundary of a shadow
// The sound reflected by a wedge's face is diffracted where the face's plane is this far behind.
constexpr double kFade_rad = pi / 18;
constexpr double kThird = 0.2316;       // of an octave, relative to the frequency in its middle
constexpr double kMinBetween_m = 1e-4;  // nearer edges are one
// Weights of the four terms of beta: the two of the direct sound, and those that the first and the
// second face reflect.
using Weights = std::array<double, 4>;

// From 0 where a point is before a face of a wedge to 1 where it is well behind its plane.
double share_behind(double angle_rad) { return std::clamp((angle_rad - pi) / kFade_rad, 0.0, 1.0); }

// The sound that the faces reflect is part of the direct sound as far as neither face can reflect
// it from one point to the other. Otherwise it is that of an image source.
Weights weights_of_direct_sound(const DiffractingEdge& edge, const Vec3& from_m, const Vec3& to_m) {
  const auto air = static_cast<double>(edge.air_rad);
  if (air > kSheet_rad) return {1, 1, 1, 1};
  const double a = edge.angle_in_air_rad(from_m), b = edge.angle_in_air_rad(to_m);
  return {1, 1, share_behind(std::max(a, b)), share_behind(air - std::min(a, b))};
}

// The rest, for the image in the first face. Where the edge is not between the points, the direct
// sound is without it, and all terms are the image's, or half of them that of either face's.
Weights weights_of_reflection(const DiffractingEdge& edge, const Vec3& from_m, const Vec3& to_m) {
  const double a = edge.angle_in_air_rad(from_m), b = edge.angle_in_air_rad(to_m);
  const double low = std::min(a, b), high = std::max(a, b), air = static_cast<double>(edge.air_rad);
  if (air > kSheet_rad) return high < pi ? Weights{1, 1, 1, 1} : Weights{};
  const double of_first = 1 - share_behind(high), behind_second = share_behind(air - low);
  // Going on, the second face comes in sight of the farther point, but not of the nearer one.
  const double between = low < air - pi ? share_behind(high - (air - pi) + pi) : 0;
  const double rest = std::min(of_first, 1 - between);
  const double direct = rest * (0.5 + 0.5 * behind_second);
  return {direct, direct, of_first, rest * behind_second};
}

// The edge between a source and a listener in cylindrical coordinates.
class Wedge : private PointsAroundEdge {
 public:
  // `straight_m` is the distance of the free field that the sound is relative to.
  Wedge(const DiffractingEdge& edge, const Vec3& from_m, const Vec3& to_m, double straight_m,
        const Weights& weights)
      : PointsAroundEdge(edge, from_m, to_m),
        index_(pi / static_cast<double>(edge.air_rad)),
        straight_m_(straight_m) {
    const double a = edge.angle_in_air_rad(from_m), b = edge.angle_in_air_rad(to_m);
    terms_ = {term(pi + a - b, weights[0]), term(pi - a + b, weights[1]),
              term(pi - a - b, weights[2]), term(pi + a + b, weights[3])};
  }

  using PointsAroundEdge::apex_m, PointsAroundEdge::path_m;
  bool is_singular() const { return PointsAroundEdge::is_singular() || !(straight_m_ > 0); }
  // Length of the edge around its apex within which the integrand changes little: less near the
  // boundary of a shadow, and less than the shortest wave's first zone.
  double scale_m(double shortest_wave_m) const {
    const double reach_m = r_from_m * r_to_m / (r_from_m + r_to_m);
    return std::min(reach_m * boundary_rad_, kZoneFraction * std::sqrt(shortest_wave_m * reach_m));
  }

  double detour_m(double z) const { return path_m(z) - straight_m_; }

  // The integrand without its phase, per metre.
  double density(double z) const {
    const double from_z = z - z_from_m, to_z = z - z_to_m;
    const double m = hypotenuse(r_from_m, from_z), l = hypotenuse(r_to_m, to_z);
    const double cosh_eta = std::max(1.0, (m * l + from_z * to_z) / (r_from_m * r_to_m));
    const double sinh_half = std::sinh(index_ * arcosh(cosh_eta) / 2);
    double beta = 0;
    for (const Term& term : terms_) {
      const double sin_half = std::sin(term.phi / 2);
      beta += term.weight * std::sin(term.phi) /
              (2 * (sinh_half * sinh_half + sin_half * sin_half) + 1e-300);
    }
    return -index_ / (4 * pi) * beta * straight_m_ / (m * l);
  }

 private:
  struct Term {
    double phi, weight;
  };

  Term term(double angle_rad, double weight) {
    // Right at the boundary of a shadow, the smallest step to one side of it.
    double phi = index_ * angle_rad;
    const double from_boundary = std::remainder(phi, 2 * pi), least = kMinAngle_rad * index_;
    if (std::abs(from_boundary) < least)
      phi += (from_boundary < -kTie_rad ? -least : least) - from_boundary;
    if (weight > 0)
      boundary_rad_ = std::min(boundary_rad_, std::max(std::abs(from_boundary), least) / index_);
    return {phi, weight};
  }

  double index_, straight_m_;
  std::array<Term, 4> terms_{};
  double boundary_rad_ = pi;
};

struct Node {
  double t = 0, density = 0, detour_m = 0;
  Tones phase{};
};

// The integral along an edge. Between nodes, the density and the phase are taken as linear.
class EdgeIntegral {
 public:
  EdgeIntegral(const Wedge& wedge, const EdgeInAir& edge)
      : wedge_(wedge),
        edge_(edge),
        apex_m_(wedge.apex_m()),
        scale_m_(wedge.scale_m(2 * pi / edge.wave_number(kTones - 1))) {
    for (std::size_t j = 0; j < kTonesPerBand; ++j) wave_numbers_[j] = edge.wave_number(j);
  }

  double t_of(double z) const { return arsinh((z - apex_m_) / scale_m_); }
  double z_of(double t) const { return apex_m_ + scale_m_ * std::sinh(t); }

  // Adds the part from t0 to t1.
  void add(double t0, double t1) {
    const int steps = std::clamp(static_cast<int>(std::ceil((t1 - t0) / kStep)), 1, kMaxNodes);
    Node last = node(t0);
    for (int i = 1; i <= steps; ++i) {
      const Node next = node(t0 + (t1 - t0) * i / steps);
      add(last, next);
      last = next;
    }
  }

  const Tones& sum() const { return sum_; }

 private:
  Node node(double t) const {
    const double z = z_of(t);
    Node made{
        t, wedge_.density(z) * scale_m_ * std::cosh(t) * edge_.weight(z), wedge_.detour_m(z), {}};
    for (std::size_t j = 0; j < kTonesPerBand; ++j) {
      Complex phase = std::polar(1.0, wave_numbers_[j] * made.detour_m);
      for (std::size_t i = j; i < kTones; i += kTonesPerBand) {
        made.phase[i] = phase;
        phase *= phase;
      }
    }
    return made;
  }

  void add(const Node& a, const Node& b) {
    const double width = b.t - a.t, turn_m = b.detour_m - a.detour_m;
    for (std::size_t j = 0; j < kTonesPerBand; ++j) {
      double x = wave_numbers_[j] * turn_m;
      for (std::size_t i = j; i < kTones; i += kTonesPerBand, x *= 2) {
        const Complex first = a.density * a.phase[i], second = b.density * b.phase[i];
        if (std::abs(x) < kSlowTurn_rad)
          sum_[i] += 0.5 * width * (first + second);
        else
          sum_[i] += width * ((second - first) * Complex(0, -1 / x) +
                              (b.density - a.density) * (b.phase[i] - a.phase[i]) / (x * x));
      }
    }
  }

  const Wedge& wedge_;
  const EdgeInAir& edge_;
  double apex_m_, scale_m_;
  std::array<double, kTonesPerBand> wave_numbers_{};
  Tones sum_{};
};

// Parts of the integral's range that are in sight.
struct Sight {
  std::vector<std::pair<double, double>> parts;
  std::optional<double> nearest;  // of the points seen, the one with the shortest path
};

template <class IsSeen>
Sight find_sight(double first, double last, const IsSeen& is_seen) {
  Sight sight;
  const auto see = [&](double t) {
    const bool seen = is_seen(t);
    if (seen && (!sight.nearest || std::abs(t) < std::abs(*sight.nearest))) sight.nearest = t;
    return seen;
  };
  const int samples =
      std::clamp(static_cast<int>((last - first) / kSightStep), kMinSights, kMaxSights);
  double start = first, before = first;
  bool was_seen = see(first);
  if (first < 0 && last > 0) see(0);
  for (int i = 1; i <= samples; ++i) {
    const double t = first + (last - first) * i / samples;
    if (see(t) != was_seen) {
      double low = before, high = t;
      for (int step = 0; step < kBisections; ++step) {
        const double middle = 0.5 * (low + high);
        (see(middle) == was_seen ? low : high) = middle;
      }
      const double change = 0.5 * (low + high);
      if (was_seen) sight.parts.emplace_back(start, change);
      start = change;
      was_seen = !was_seen;
    }
    before = t;
  }
  if (was_seen) sight.parts.emplace_back(start, last);
  return sight;
}

// Multiplies the tones of a pressure by factor(tone).
template <class Factor>
void scale(Tones& pressure, const Factor& factor) {
  for (std::size_t i = 0; i < kTones; ++i) pressure[i] *= factor(i);
}

// The integral over a whole edge, relative to a spherical wave at the end of the shortest path.
Tones whole_edge(const EdgeInAir& edge, const Vec3& from_m, const Vec3& to_m, double path_m) {
  const double straight_m = length(to_m - from_m);
  const Wedge wedge(edge.edge(), from_m, to_m, straight_m, {1, 1, 1, 1});
  if (wedge.is_singular()) return {};
  EdgeIntegral integral(wedge, edge);
  integral.add(integral.t_of(edge.first_m()), integral.t_of(edge.last_m()));
  Tones relative = integral.sum();
  scale(relative, [&](std::size_t tone) {
    return std::polar(path_m / straight_m, -edge.wave_number(tone) * (path_m - straight_m));
  });
  return relative;
}

// A sheet blocks the straight line where the corner does that is farther in the line's way.
DiffractingEdge at_blocking_corner(const DiffractingEdge& sheet, const Vec3& from_m,
                                   const Vec3& to_m) {
  const Vec3f aside_m = 0.5f * sheet.width_m * sheet.air;
  DiffractingEdge corners[] = {sheet, sheet};
  double depth_rad[2];
  for (int c = 0; c < 2; ++c) {
    corners[c].from_m += c == 0 ? aside_m : -aside_m;
    corners[c].to_m += c == 0 ? aside_m : -aside_m;
    depth_rad[c] = std::abs(corners[c].angle_rad(from_m) - corners[c].angle_rad(to_m));
  }
  return corners[depth_rad[0] < depth_rad[1] ? 1 : 0];
}

// The share of one of the two sheets across each other that stand for a post: the one across the
// path counts.
double share_of_direction(const DiffractingEdge& edge, const Vec3& path_m) {
  const double over = dot(path_m, Vec3(edge.air)), beside = dot(path_m, Vec3(edge.face));
  return over * over / std::max(over * over + beside * beside, 1e-12);
}

// Returns whether the edge bends sound from one point to the other: both are in the air, or one of
// them on a face.
bool bends(const DiffractingEdge& edge, const Vec3& from_m, const Vec3& to_m, const Vec3& on_edge) {
  const auto is_beside = [&](const Vec3& point_m) {
    return edge.is_in_air(point_m) || (point_m == on_edge && edge.is_on_face(point_m));
  };
  return edge.is_between(from_m, to_m) && is_beside(from_m) && is_beside(to_m);
}

// Multiplies the pressure by what mirrors reflect on the path from an end to the edge, unless that
// goes by their planes alone.
void reflect(const EdgeInAir& edge, const PathEnd& end, double z, EdgeSound& sound) {
  if (!end.is_image() || !end.planes.empty()) return;
  const auto path = edge.path_from(end, z);
  scale(sound.pressure, [&](std::size_t tone) {
    return path ? std::sqrt(static_cast<double>(path->reflected[tone / kTonesPerBand])) : 0.0;
  });
}

// To waves for which a corner is that of a sheet, the wedge is `sheet`, unless that is null.
EdgeSound sound_over(const EdgeInAir& edge, const DiffractingEdge& faces, const Wedge& wedge,
                     const Wedge* sheet, const PathEnd& from, const PathEnd& to) {
  EdgeSound sound;
  if (wedge.is_singular()) return sound;
  EdgeIntegral integral(wedge, edge);
  const bool source_is_beside = faces.is_in_air(from.seen_m),
             listener_is_beside = faces.is_in_air(to.seen_m);
  const Sight sight =
      find_sight(integral.t_of(edge.first_m()), integral.t_of(edge.last_m()), [&](double t) {
        const double z = integral.z_of(t);
        const bool by_source = source_is_beside && edge.path_from(from, z).has_value();
        const bool by_listener = listener_is_beside && (by_source || !sound.is_seen_by_listener) &&
                                 edge.path_from(to, z).has_value();
        sound.is_seen_by_source |= by_source;
        sound.is_seen_by_listener |= by_listener;
        return by_source && by_listener && edge.is_open(z);
      });
  if (!sight.nearest) return sound;
  for (const auto& [first, last] : sight.parts) integral.add(first, last);
  const double z = integral.z_of(*sight.nearest);
  sound.is_heard = true;
  sound.pressure = integral.sum();
  scale(sound.pressure, [&](std::size_t tone) { return edge.share(tone); });
  if (sheet != nullptr) {
    EdgeIntegral to_long_waves(*sheet, edge);
    for (const auto& [first, last] : sight.parts)
      to_long_waves.add(to_long_waves.t_of(integral.z_of(first)),
                        to_long_waves.t_of(integral.z_of(last)));
    for (std::size_t i = 0; i < kTones; ++i)
      sound.pressure[i] += (1 - edge.share(i)) * to_long_waves.sum()[i];
  }
  reflect(edge, from, z, sound);
  reflect(edge, to, z, sound);
  sound.first_m = sound.last_m =
      Vec3(faces.from_m) + std::clamp(z, 0.0, edge.length_m()) * Vec3(faces.along);
  sound.path_m = wedge.path_m(z);
  return sound;
}

}  // namespace

Bands power_of(const Tones& pressure) {
  Bands power{};
  for (std::size_t i = 0; i < kTones; ++i)
    power[i / kTonesPerBand] += static_cast<float>(std::norm(pressure[i]) / kTonesPerBand);
  return power;
}

Bands power_of(const Tones& straight, double straight_m, std::span<const EdgeSound> sounds,
               double speed_of_sound_mps) {
  Bands power = power_of(straight);
  const auto add = [&](const Tones& a, const Tones& b, double difference_m) {
    for (std::size_t i = 0; i < kTones; ++i) {
      const double turn = 0.5 * kThird * wave_number(i, speed_of_sound_mps) * difference_m;
      const double together = std::abs(turn) > 1e-6 ? std::sin(turn) / turn : 1;
      power[i / kTonesPerBand] +=
          static_cast<float>(2 * together * std::real(a[i] * std::conj(b[i])) / kTonesPerBand);
    }
  };
  for (std::size_t i = 0; i < sounds.size(); ++i) {
    const Bands own = power_of(sounds[i].pressure);
    for (std::size_t b = 0; b < kBandCount; ++b) power[b] += own[b];
    add(straight, sounds[i].pressure, sounds[i].path_m - straight_m);
    for (std::size_t j = 0; j < i; ++j)
      add(sounds[j].pressure, sounds[i].pressure, sounds[i].path_m - sounds[j].path_m);
  }
  for (float& share : power) share = std::max(share, 0.0f);
  return power;
}

EdgeSound sound_over_edge(const EdgeInAir& edge, const PathEnd& from, const PathEnd& to) {
  const DiffractingEdge faces =
      edge.edge().is_sheet ? at_blocking_corner(edge.edge(), from.seen_m, to.seen_m) : edge.edge();
  const Wedge wedge(faces, from.seen_m, to.seen_m, length(to.seen_m - from.seen_m),
                    weights_of_direct_sound(faces, from.seen_m, to.seen_m));
  EdgeSound sound = sound_over(edge, faces, wedge, nullptr, from, to);
  if (!sound.is_heard || !faces.is_post) return sound;
  const double share = share_of_direction(faces, to.seen_m - from.seen_m);
  scale(sound.pressure, [&](std::size_t) { return share; });
  return sound;
}

// A corner at the end of a thin plate is the border of a sheet to long waves.
EdgeSound sound_over_border(const EdgeInAir& border, const PathEnd& from, const PathEnd& to,
                            const Vec3& image_m) {
  const DiffractingEdge& edge = border.edge();
  const Vec3 &from_m = from.seen_m, &to_m = to.seen_m;
  const auto wedge_of = [&](const DiffractingEdge& faces) {
    return Wedge(faces, from_m, to_m, length(to_m - image_m),
                 weights_of_reflection(faces, from_m, to_m));
  };
  if (weights_of_reflection(edge, from_m, to_m) == Weights{}) return {};
  const Wedge wedge = wedge_of(edge);
  if (!std::isfinite(edge.width_m)) return sound_over(border, edge, wedge, nullptr, from, to);
  DiffractingEdge sheet = edge;
  sheet.air_rad = static_cast<float>(2 * pi);
  const Wedge as_sheet = wedge_of(sheet);
  return sound_over(border, edge, wedge, &as_sheet, from, to);
}

EdgeSound sound_over_edges(const EdgeInAir& first, const EdgeInAir& second, const PathEnd& from,
                           const PathEnd& to) {
  const Vec3 &from_m = from.seen_m, &to_m = to.seen_m;
  EdgeSound sound;
  // A sheet stands for corners, and does not go with them.
  if (first.edge().is_sheet != second.edge().is_sheet && std::isfinite(first.edge().width_m) &&
      std::isfinite(second.edge().width_m))
    return sound;
  const auto [z1, z2] = path_over_edges(first, second, from_m, to_m);
  const Vec3 a = first.point_m(z1), b = second.point_m(z2);
  const double before_m = length(a - from_m), between_m = length(b - a), after_m = length(to_m - b);
  if (!(before_m > 0 && between_m > kMinBetween_m && after_m > 0)) return sound;
  if (!bends(first.edge(), from_m, b, b) || !bends(second.edge(), a, to_m, a)) return sound;
  if (!first.path_from(from, z1) || !second.path_from(to, z2)) return sound;
  if (!first.is_open(z1) || !second.is_open(z2) || !first.sees(z1, second, z2)) return sound;

  const Vec3 onward = (b - a) / between_m;
  const double path_m = before_m + between_m + after_m, straight_m = length(to_m - from_m);
  Vec3 target_m = a + (between_m + after_m) * onward, start_m = b - (before_m + between_m) * onward;
  const bool first_bends_more = length(target_m - from_m) < length(to_m - start_m);
  if (first_bends_more)
    start_m = a;
  else
    target_m = b;
  const Tones p1 = whole_edge(first, from_m, target_m, before_m + length(target_m - a)),
              p2 = whole_edge(second, start_m, to_m, length(b - start_m) + after_m);
  const bool share_a_face = first.edge().is_on_face(b) && second.edge().is_on_face(a);
  const auto share = [&](std::size_t tone) {
    const double of_first = first.share(tone);
    return share_a_face ? 0.5 * of_first : of_first * second.share(tone);
  };
  for (std::size_t i = 0; i < kTones; ++i)
    sound.pressure[i] =
        p1[i] * p2[i] *
        std::polar(share(i) * straight_m / path_m, first.wave_number(i) * (path_m - straight_m));
  reflect(first, from, z1, sound);
  reflect(second, to, z2, sound);
  sound.is_heard = true;
  sound.first_m = a;
  sound.last_m = b;
  sound.path_m = path_m;
  return sound;
}

}  // namespace clamor
