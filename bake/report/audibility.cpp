#include "bake/report/audibility.h"

#include <algorithm>
#include <array>
#include <cmath>

#include <fmt/format.h>

#include "bake/trace/diffuse_directions.h"
#include "common/maths.h"
#include "common/random.h"
#include "common/result.h"

namespace clamor {

namespace {

constexpr std::uint64_t kKey = 0x61756469626c65u;
constexpr std::uint32_t kWalks = 64, kLegs = 32;
constexpr double kFewEscape = 0.1;  // maximum share of escaping walks at an enclosed point

// A cavity is too small for a room if its mean free path is below this (a cube of 0.75 m) and it
// fills a small part of the level's bounds.
constexpr double kNarrow_m = 0.5, kNarrowShare = 0.1;
// A cavity whose surfaces are mostly seen from behind is the inside of a solid, unless the level's
// walls face outwards. A solid is smaller than a room (a cube of 1.8 m), or it fills a small part
// of the bounds and stands in a room.
constexpr double kBehind = 0.75, kThick_m = 1.2, kThickOfExtent = 0.2, kBehindShare = 0.3;

// A level is closed if this share of its bounds is enclosed. A point is outside if this share of
// rays escapes.
constexpr double kClosedShare = 0.5, kOutsideEscapes = 0.25;

constexpr double kClearance_m = 0.2;    // clearance of proposed points, in levels of 10 m or more
constexpr double kSurface_m = 0.01;     // start distance of rays that look for a surface at a point
constexpr double kOffSurface_m = 0.02;  // distance by which a point is moved off a surface
constexpr double kAtSurface_m = 1e-3;   // tolerance for an emitter on a surface
// Tolerance for a listener, whose rays start on either side by chance.
constexpr double kOnSurface_m = 1e-5;
constexpr double kInaudible = 1e-12;  // energy of the direct sound relative to 1 m and gain 1

constexpr std::size_t kMaxEmitters = 16'384, kMostExplored = 512;
constexpr std::size_t kLitEmitters = 64, kLitPlaces = 512, kPairs = 96, kMostTried = 200;
constexpr std::size_t kShownEmitters = 3;

// Fibonacci sphere: `count` evenly distributed directions.
Vec3 spread_direction(std::uint32_t index, std::uint32_t count) {
  constexpr double kGolden = 0.6180339887498949;
  const double turn = index * kGolden;
  return on_sphere(1 - (2 * index + 1.0) / count, turn - std::floor(turn));
}

// At most `most` of the values, evenly spaced.
template <class T>
std::vector<T> thinned(std::span<const T> values, std::size_t most) {
  if (values.size() <= most) return {values.begin(), values.end()};
  std::vector<T> kept;
  for (std::size_t i = 0; i < most; ++i) kept.push_back(values[i * values.size() / most]);
  return kept;
}

// Rounded to centimetres, as printed.
Vec3 rounded(const Vec3& place_m) { return glm::round(place_m * 100.0) / 100.0; }

double interval(std::vector<double> values) {
  std::sort(values.begin(), values.end());
  return values[values.size() * 9 / 10] - values[values.size() / 10];
}

std::string place_in_words(const Vec3& place_m) {
  std::string text;
  for (int i = 0; i < 3; ++i) text += fmt::format("{}{:.6g}", i > 0 ? "," : "", place_m[i] + 0.0);
  return text;
}

std::string width_in_words(double width_m) {
  return width_m < 0.995 ? fmt::format("{:.0f} cm", std::max(1.0, 100 * width_m))
                         : fmt::format("{:.1f} m", width_m);
}

std::string works_in_words(const InaudiblePlace& place, const char* what) {
  if (!place.alternative_m) return "";
  return fmt::format("; the nearest place found {} is {}", what,
                     place_in_words(*place.alternative_m));
}

}  // namespace

// What random walks from a point found.
struct Audibility::Exploration {
  // Points just in front of the hit surfaces, in the order of the walks.
  std::vector<Vec3> points_m;
  std::size_t escaped = 0;  // walks that left the level
  std::size_t direct = 0;   // walks that left without hitting a surface
  std::size_t behind = 0;   // hits on the back of a surface
  double legs_m = 0;
  bool passes = false;  // whether any surface transmits sound

  bool is_closed_in() const { return static_cast<double>(escaped) <= kFewEscape * kWalks; }
  double width_m() const {
    return points_m.empty() ? 0 : legs_m / static_cast<double>(points_m.size());
  }
};

Audibility::Audibility(const Scene& scene, const Mesh& mesh, std::span<const Material> materials)
    : scene_(scene), materials_(materials), empty_(mesh.triangles.empty()) {
  if (empty_) return;
  low_m_ = high_m_ = Vec3(mesh.vertices_m[mesh.triangles[0][0]]);
  for (const auto& triangle : mesh.triangles)
    for (const auto corner : triangle) {
      low_m_ = glm::min(low_m_, Vec3(mesh.vertices_m[corner]));
      high_m_ = glm::max(high_m_, Vec3(mesh.vertices_m[corner]));
    }

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
  inside_m_ = thinned<Vec3>(inside_m, kPairs);
}

// Cell centres of a coarse grid over the level's bounds.
std::vector<Vec3> Audibility::grid_m() const {
  std::vector<Vec3> places_m;
  constexpr int kAcross = 10, kUp = 6;
  for (int x = 0; x < kAcross; ++x)
    for (int y = 0; y < kUp; ++y)
      for (int z = 0; z < kAcross; ++z)
        places_m.push_back(
            rounded(low_m_ + (high_m_ - low_m_) *
                                 Vec3((x + 0.5) / kAcross, (y + 0.5) / kUp, (z + 0.5) / kAcross)));
  return places_m;
}

bool Audibility::transmits(std::uint16_t material) const {
  if (material >= materials_.size()) return false;
  const Bands& through = materials_[material].transmission;
  return std::any_of(through.begin(), through.end(), [](float share) { return share > 0; });
}

Audibility::Exploration Audibility::explore(const Vec3& from_m) const {
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
      found.passes |= transmits(hit->material);
      at_m = scene_.away_from_surface(hit->point_m, hit->normal);
      found.points_m.push_back(at_m);
      direction = diffuse_direction(hit->normal, philox(kKey, {walk, leg, 0, 0}));
    }
  }
  return found;
}

// Share of the level's bounds that the walks covered, ignoring outliers.
double Audibility::share_of_bounds(const Exploration& found) const {
  double share = 1;
  for (int axis = 0; axis < 3; ++axis) {
    const double all_m = high_m_[axis] - low_m_[axis];
    std::vector<double> along;
    for (const Vec3& point_m : found.points_m) along.push_back(point_m[axis]);
    if (all_m > 1e-6) share *= std::min(1.0, interval(std::move(along)) / all_m);
  }
  return share;
}

bool Audibility::sees(const Vec3& from_m, const Vec3& to_m) const {
  const Vec3 way_m = to_m - from_m;
  double left_m = length(way_m);
  if (!(left_m > 0)) return true;
  const Vec3 direction = way_m / left_m;
  Vec3 at_m = from_m;
  for (int crossing = 0; crossing < 32; ++crossing) {
    const auto hit = scene_.intersect(at_m, direction);
    // A point at offset_m() in front of a wall is not visible through that wall.
    if (!hit || hit->distance_m >= left_m - 0.25 * scene_.offset_m()) return true;
    if (!transmits(hit->material)) return false;
    const double step_m = hit->distance_m + scene_.offset_m();
    at_m += direction * step_m;
    left_m -= step_m;
  }
  return false;
}

bool Audibility::connected(std::span<const Vec3> some_m, std::span<const Vec3> others_m) const {
  return std::any_of(some_m.begin(), some_m.end(), [&](const Vec3& one_m) {
    return std::any_of(others_m.begin(), others_m.end(),
                       [&](const Vec3& other_m) { return sees(one_m, other_m); });
  });
}

// Whether sound may be diffracted around an obstacle: there is a free path over a point beside the
// middle of the line. The longest wavelengths reach 8 m beside it.
bool Audibility::bends_to(const Vec3& from_m, const Vec3& to_m) const {
  const Vec3 way_m = to_m - from_m;
  if (!(length(way_m) > 0)) return true;
  const Basis across = basis_around(normalize(way_m));
  constexpr int kTurns = 8;
  for (const double beside_m : {0.5, 1.0, 2.0, 4.0, 8.0})
    for (int turn = 0; turn < kTurns; ++turn) {
      const Vec3 around = on_sphere(0, turn / static_cast<double>(kTurns));
      const Vec3 over_m = from_m + 0.5 * way_m +
                          beside_m * (around.x * across.tangent + around.y * across.bitangent);
      if (sees(from_m, over_m) && sees(over_m, to_m)) return true;
    }
  return false;
}

bool Audibility::has_clearance(const Vec3& place_m) const {
  const double clearance_m = std::min(kClearance_m, 0.02 * length(high_m_ - low_m_));
  constexpr std::uint32_t kRays = 26;
  for (std::uint32_t i = 0; i < kRays; ++i) {
    const auto hit = scene_.intersect(place_m, spread_direction(i, kRays));
    if (hit && hit->distance_m < clearance_m) return false;
  }
  return true;
}

// Alternative points, nearest first: on spheres around the point and on the grid.
std::vector<Vec3> Audibility::candidates_m(const Vec3& from_m) const {
  std::vector<Vec3> places_m = grid_m();
  const Vec3 margin_m(0.01);
  for (const double radius_m : {0.3, 0.5, 0.75, 1.0, 1.5, 2.0, 3.0, 4.5})
    for (int x = -1; x <= 1; ++x)
      for (int y = -1; y <= 1; ++y)
        for (int z = -1; z <= 1; ++z) {
          if (x == 0 && y == 0 && z == 0) continue;
          const Vec3 place_m = rounded(from_m + radius_m * normalize(Vec3(x, y, z)));
          if (glm::all(glm::greaterThan(place_m, low_m_ + margin_m)) &&
              glm::all(glm::lessThan(place_m, high_m_ - margin_m)))
            places_m.push_back(place_m);
        }
  // Points at the same height are preferred.
  const auto cost = [&](const Vec3& place_m) {
    const Vec3 way_m = place_m - from_m;
    return length(way_m) + 0.3 * std::abs(way_m.y);
  };
  std::stable_sort(places_m.begin(), places_m.end(),
                   [&](const Vec3& a, const Vec3& b) { return cost(a) < cost(b); });
  return places_m;
}

Audibility::Hollow Audibility::hollow_of(const Exploration& found) const {
  if (!found.is_closed_in() || found.passes || found.points_m.empty()) return Hollow::kNone;
  const double share = share_of_bounds(found);
  if (found.width_m() < kNarrow_m && share < kNarrowShare) return Hollow::kNarrow;
  if (static_cast<double>(found.behind) < kBehind * static_cast<double>(found.points_m.size()))
    return Hollow::kNone;
  if (found.width_m() < std::min(kThick_m, kThickOfExtent * length(high_m_ - low_m_)))
    return Hollow::kThick;
  return share < kBehindShare ? Hollow::kWide : Hollow::kNone;
}

// The nearest point that is neither in a solid nor outside.
std::optional<Audibility::AirPlace> Audibility::nearest_air(const Vec3& from_m) const {
  std::size_t tried = 0;
  for (const Vec3& place_m : candidates_m(from_m)) {
    if (!has_clearance(place_m)) continue;
    if (++tried > kMostTried) break;
    const Exploration found = explore(place_m);
    if (hollow_of(found) != Hollow::kNone) continue;
    if (closed_ && !found.is_closed_in() && !connected(std::span(&place_m, 1), inside_m_)) continue;
    return AirPlace{place_m, found.is_closed_in()};
  }
  return std::nullopt;
}

std::optional<InaudiblePlace> Audibility::judged(const Vec3& place_m) const {
  const Exploration found = explore(place_m);
  if (const Hollow hollow = hollow_of(found); hollow != Hollow::kNone) {
    const auto air = nearest_air(place_m);
    // A level in which every point looks like this may be intended, and so may a room in the open.
    const bool is_solid =
        hollow == Hollow::kNarrow || (air && hollow == Hollow::kThick) || (air && air->closed_in);
    if (is_solid) {
      InaudiblePlace solid{InaudibleCause::kInSolid, found.width_m(), {}, {}};
      if (air) solid.alternative_m = air->place_m;
      return solid;
    }
  }
  if (closed_ && static_cast<double>(found.direct) >= kOutsideEscapes * kWalks) {
    std::vector<Vec3> seen_m = thinned<Vec3>(found.points_m, kPairs);
    seen_m.insert(seen_m.begin(), place_m);
    if (!connected(seen_m, inside_m_)) {
      InaudiblePlace outside{InaudibleCause::kOutside, 0, {}, {}};
      if (const auto air = nearest_air(place_m)) outside.alternative_m = air->place_m;
      return outside;
    }
  }
  return std::nullopt;
}

// Normal of a surface within `within_m` of the point, if any.
std::optional<Vec3> Audibility::surface_at(const Vec3& place_m, double within_m) const {
  constexpr std::uint32_t kRays = 12;
  std::uint32_t at_surface = 0;
  Vec3 normal{};
  for (std::uint32_t i = 0; i < kRays; ++i) {
    const Vec3 off = spread_direction(i, kRays);
    const auto hit = scene_.intersect(place_m + kSurface_m * off, -off);
    if (!hit || std::abs(hit->distance_m - kSurface_m) * std::abs(dot(hit->normal, off)) > within_m)
      continue;
    ++at_surface;
    normal = hit->normal;
  }
  if (at_surface + 2 < kRays) return std::nullopt;
  return normal;
}

// Judges a point on a surface whose two sides differ.
std::optional<InaudiblePlace> Audibility::judged_on_surface(const Vec3& place_m) const {
  const auto found = surface_at(place_m, kAtSurface_m);
  if (!found) return std::nullopt;
  const Vec3 normal = *found;
  struct Side {
    Vec3 place_m;
    bool unheard = false, open = false;
  };
  std::array<Side, 2> sides = {Side{place_m + kOffSurface_m * normal},
                               Side{place_m - kOffSurface_m * normal}};
  for (Side& side : sides) {
    side.unheard = judged(side.place_m).has_value();
    side.open = static_cast<double>(explore(side.place_m).direct) > 0.9 * kWalks;
  }
  if (sides[0].unheard == sides[1].unheard && sides[0].open == sides[1].open) return std::nullopt;
  const bool second = sides[0].unheard || (sides[0].open && !sides[1].unheard);
  return InaudiblePlace{InaudibleCause::kOnSurface, 0, rounded(sides[second ? 1 : 0].place_m), {}};
}

// Fast conservative test: true for every point that judged() may reject.
bool Audibility::looks_suspicious(const Vec3& place_m) const {
  constexpr std::uint32_t kRays = 16, kMany = 10;
  std::uint32_t near = 0, behind = 0, escaped = 0, at_surface = 0;
  for (std::uint32_t i = 0; i < kRays; ++i) {
    const auto hit = scene_.intersect(place_m, spread_direction(i, kRays));
    near += hit && hit->distance_m < 2 * kNarrow_m;
    behind += hit && hit->from_behind;
    escaped += !hit;
  }
  for (std::uint32_t i = 0; i < 4; ++i) {
    const Vec3 off = spread_direction(i, 4);
    const auto hit = scene_.intersect(place_m + kSurface_m * off, -off);
    at_surface += hit && hit->distance_m <= kSurface_m + 2 * kAtSurface_m;
  }
  return near >= kMany || behind >= kMany || at_surface >= 3 ||
         (closed_ && escaped >= kRays * kOutsideEscapes / 2);
}

std::vector<InaudibleEmitter> Audibility::unheard(std::span<const Emitter> emitters) const {
  std::vector<InaudibleEmitter> found;
  if (empty_) return found;
  std::vector<std::size_t> indices(emitters.size());
  for (std::size_t i = 0; i < indices.size(); ++i) indices[i] = i;
  std::vector<Vec3> fine_m;  // points near audible emitters
  std::size_t explored = 0;
  for (const std::size_t i : thinned<std::size_t>(indices, kMaxEmitters)) {
    const Vec3& place_m = emitters[i].position_m;
    if (!looks_suspicious(place_m)) continue;
    auto bad = judged_on_surface(place_m);
    if (!bad && std::none_of(fine_m.begin(), fine_m.end(),
                             [&](const Vec3& other_m) { return sees(place_m, other_m); })) {
      if (++explored > kMostExplored) break;
      bad = judged(place_m);
      if (!bad && fine_m.size() < 16) fine_m.push_back(place_m);
    }
    if (bad) found.push_back({i, *bad});
  }
  for (InaudibleEmitter& one : found) one.place.emitter = one.emitter;
  return found;
}

// Emitters, and points on surfaces that their sound reaches.
std::vector<Vec3> Audibility::lit_places_m(std::span<const Emitter> emitters) const {
  const std::vector<Emitter> some = thinned<Emitter>(emitters, kLitEmitters);
  std::vector<Vec3> lit_m;
  for (const Emitter& emitter : some) lit_m.push_back(emitter.position_m);
  if (empty_) return lit_m;
  for (const Emitter& emitter : some)
    for (const Vec3& point_m :
         thinned<Vec3>(explore(emitter.position_m).points_m, kLitPlaces / some.size()))
      lit_m.push_back(point_m);
  return lit_m;
}

std::vector<std::optional<InaudiblePlace>> Audibility::inaudible_at(
    std::span<const Vec3> listeners_m, std::span<const Emitter> emitters, const Air& air) const {
  std::vector<std::optional<InaudiblePlace>> answers(listeners_m.size());
  if (emitters.empty()) return answers;
  const std::vector<Vec3> lit_m = lit_places_m(emitters);
  const std::vector<Vec3> some_lit_m = thinned<Vec3>(lit_m, kPairs);
  const Bands loss_per_m = air_loss_per_m(air);
  const double extent_m = length(high_m_ - low_m_);

  const auto hears = [&](const Vec3& place_m) { return connected(std::span(&place_m, 1), lit_m); };
  const auto is_far_away = [&](const Vec3& place_m) {
    double energy = 0;
    for (const Emitter& emitter : emitters) {
      // Reflections are louder than the direct sound by at most this distance ratio.
      const double away_m = std::max(1.0, length(place_m - emitter.position_m) - extent_m);
      const double min_loss = *std::min_element(loss_per_m.begin(), loss_per_m.end());
      const double amplitude = emitter.gain / away_m;
      energy += amplitude * amplitude * exp_of(-min_loss * away_m);
    }
    return energy < kInaudible;
  };
  const auto nearest_that_hears = [&](const Vec3& place_m) -> std::optional<Vec3> {
    if (empty_) {
      Vec3 way_m = place_m - emitters[0].position_m;
      way_m = way_m / std::max({std::abs(way_m.x), std::abs(way_m.y), std::abs(way_m.z), 1e-9});
      return rounded(emitters[0].position_m + 2.0 * normalize(way_m));
    }
    for (const Vec3& other_m : candidates_m(place_m))
      if (has_clearance(other_m) && connected(std::span(&other_m, 1), some_lit_m)) return other_m;
    return std::nullopt;
  };

  for (std::size_t i = 0; i < listeners_m.size(); ++i) {
    const Vec3& place_m = listeners_m[i];
    if (is_far_away(place_m)) {
      const bool silent = std::all_of(emitters.begin(), emitters.end(),
                                      [](const Emitter& emitter) { return !(emitter.gain > 0); });
      if (!silent)
        answers[i] = InaudiblePlace{InaudibleCause::kFarAway, 0, nearest_that_hears(place_m), {}};
      continue;
    }
    if (empty_) continue;
    if (const auto normal = surface_at(place_m, kOnSurface_m)) {
      InaudiblePlace found{InaudibleCause::kOnSurface, 0, {}, {}};
      for (const double side_m : {kOffSurface_m, -kOffSurface_m}) {
        const Vec3 beside_m = rounded(place_m + side_m * *normal);
        if (!found.alternative_m && hears(beside_m)) found.alternative_m = beside_m;
      }
      answers[i] = found;
      continue;
    }
    if (hears(place_m) || connected(thinned<Vec3>(explore(place_m).points_m, kPairs), some_lit_m))
      continue;

    auto why = judged(place_m);
    if (!why) {
      const std::vector<Emitter> some = thinned<Emitter>(emitters, kLitEmitters);
      const auto silent = unheard(some);
      if (silent.size() == some.size()) {
        why = silent[0].place;
        why->emitter = static_cast<std::size_t>(
            std::find(emitters.begin(), emitters.end(), some[silent[0].emitter]) -
            emitters.begin());
        answers[i] = why;
        continue;
      }
      if (std::any_of(some_lit_m.begin(), some_lit_m.end(),
                      [&](const Vec3& lit_place_m) { return bends_to(place_m, lit_place_m); }))
        continue;
      why = InaudiblePlace{InaudibleCause::kShutOff, 0, {}, {}};
    }
    why->alternative_m = nearest_that_hears(place_m);
    answers[i] = why;
  }
  return answers;
}

namespace {

std::string cause(const InaudiblePlace& place) {
  switch (place.why) {
    case InaudibleCause::kInSolid:
      return fmt::format(
          "inside a solid or a closed hollow, whose surfaces are {} apart on average",
          width_in_words(place.width_m));
    case InaudibleCause::kOutside:
      return "outside the level, which is closed";
    case InaudibleCause::kOnSurface:
      return "on a surface";
    case InaudibleCause::kFarAway:
      return "too far from every emitter";
    case InaudibleCause::kShutOff:
      break;
  }
  return "shut off from every emitter";
}

std::string emitter_in_words(const InaudiblePlace& place, const std::string& name) {
  if (place.why == InaudibleCause::kOnSurface)
    return fmt::format(
        "emitter {} lies on a surface, so half of its sound leaves on the far side{}",
        in_quotes(name), works_in_words(place, "off it"));
  return fmt::format("emitter {} lies {}, so hardly any of its sound is heard {}{}",
                     in_quotes(name), cause(place),
                     place.why == InaudibleCause::kOutside ? "inside" : "elsewhere",
                     works_in_words(place, "that works"));
}

}  // namespace

std::vector<std::string> in_words(std::span<const InaudibleEmitter> unheard,
                                  std::span<const Emitter> emitters) {
  std::vector<std::string> lines;
  for (const InaudibleEmitter& one : unheard.first(std::min(unheard.size(), kShownEmitters)))
    lines.push_back(emitter_in_words(one.place, emitters[one.emitter].name));
  if (unheard.size() > kShownEmitters)
    lines.push_back(fmt::format("{} more emitters lie inside solids, outside or on surfaces",
                                unheard.size() - kShownEmitters));
  return lines;
}

std::string in_words(const InaudiblePlace& unheard, const Vec3& listener_m,
                     std::span<const Emitter> emitters) {
  const std::string where = "nothing is heard at " + place_in_words(listener_m) + ": ";
  if (unheard.emitter)  // some sound may leak out of a solid
    return "hardly anything" + where.substr(7) +
           emitter_in_words(unheard, emitters[*unheard.emitter].name);
  return where + "the listener is " + cause(unheard) +
         works_in_words(unheard, "where an emitter is heard");
}

}  // namespace clamor
