#include "bake/report/audibility.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "common/maths.h"
#include "common/sphere.h"

namespace clamor {

namespace {

// A cavity is too small for a room if its mean free path is below this (a cube of 0.75 m) and it
// fills a small part of the level's bounds.
constexpr double kNarrow_m = 0.5, kNarrowShare = 0.1;
// A cavity whose surfaces are mostly seen from behind is the inside of a solid, unless the level's
// walls face outwards. A solid is smaller than a room (a cube of 1.8 m), or it fills a small part
// of the bounds and stands in a room.
constexpr double kBehind = 0.75, kThick_m = 1.2, kThickOfExtent = 0.2, kBehindShare = 0.3;

// A point is outside a closed level if this share of rays escapes.
constexpr double kOutsideEscapes = 0.25;

constexpr double kSurface_m = 0.01;     // start distance of rays that look for a surface at a point
constexpr double kOffSurface_m = 0.02;  // distance by which a point is moved off a surface
constexpr double kAtSurface_m = 1e-3;   // tolerance for an emitter on a surface
// Tolerance for a listener, whose rays start on either side by chance.
constexpr double kOnSurface_m = 1e-5;
constexpr double kInaudible = 1e-12;  // energy of the direct sound relative to 1 m and gain 1

constexpr std::size_t kMaxEmitters = 16'384, kMaxExplored = 512;
constexpr std::size_t kLitEmitters = 64, kLitPlaces = 512, kPairs = 96, kMaxTried = 200;

}  // namespace

Audibility::Audibility(const Scene& scene, const Mesh& mesh, std::span<const Material> materials)
    : space_(scene, mesh, materials) {}

Audibility::Cavity Audibility::cavity_of(const Exploration& found) const {
  if (!found.is_enclosed() || found.transmits || found.points_m.empty()) return Cavity::kNone;
  const double share = space_.share_of_bounds(found);
  if (found.mean_free_path_m() < kNarrow_m && share < kNarrowShare) return Cavity::kNarrow;
  if (static_cast<double>(found.behind) < kBehind * static_cast<double>(found.points_m.size()))
    return Cavity::kNone;
  if (found.mean_free_path_m() < std::min(kThick_m, kThickOfExtent * space_.extent_m()))
    return Cavity::kThick;
  return share < kBehindShare ? Cavity::kWide : Cavity::kNone;
}

// The nearest point that is neither in a solid nor outside.
std::optional<Audibility::AirPlace> Audibility::nearest_air(const Vec3& from_m) const {
  std::size_t tried = 0;
  for (const Vec3& place_m : space_.candidates_m(from_m)) {
    if (!space_.has_clearance(place_m)) continue;
    if (++tried > kMaxTried) break;
    const Exploration found = space_.explore(place_m);
    if (cavity_of(found) != Cavity::kNone) continue;
    if (space_.is_closed() && !found.is_enclosed() &&
        !space_.any_sees(std::span(&place_m, 1), space_.enclosed_points_m()))
      continue;
    return AirPlace{place_m, found.is_enclosed()};
  }
  return std::nullopt;
}

std::optional<InaudiblePlace> Audibility::judge(const Vec3& place_m) const {
  const Exploration found = space_.explore(place_m);
  if (const Cavity cavity = cavity_of(found); cavity != Cavity::kNone) {
    const auto air = nearest_air(place_m);
    // A level in which every point looks like this may be intended, and so may a room in the open.
    const bool is_solid =
        cavity == Cavity::kNarrow || (air && cavity == Cavity::kThick) || (air && air->is_enclosed);
    if (is_solid) {
      InaudiblePlace solid{InaudibleCause::kInSolid, found.mean_free_path_m(), {}, {}};
      if (air) solid.alternative_m = air->place_m;
      return solid;
    }
  }
  if (space_.is_closed() &&
      static_cast<double>(found.direct) >= kOutsideEscapes * SpaceExplorer::kWalks) {
    std::vector<Vec3> seen_m = thinned<Vec3>(found.points_m, kPairs);
    seen_m.insert(seen_m.begin(), place_m);
    if (!space_.any_sees(seen_m, space_.enclosed_points_m())) {
      InaudiblePlace outside{InaudibleCause::kOutside, 0, {}, {}};
      if (const auto air = nearest_air(place_m)) outside.alternative_m = air->place_m;
      return outside;
    }
  }
  return std::nullopt;
}

// Judges a point on a surface whose two sides differ.
std::optional<InaudiblePlace> Audibility::judge_on_surface(const Vec3& place_m) const {
  const auto found = space_.surface_at(place_m, kAtSurface_m);
  if (!found) return std::nullopt;
  const Vec3 normal = *found;
  struct Side {
    Vec3 place_m;
    bool inaudible = false, open = false;
  };
  std::array<Side, 2> sides = {Side{place_m + kOffSurface_m * normal},
                               Side{place_m - kOffSurface_m * normal}};
  for (Side& side : sides) {
    side.inaudible = judge(side.place_m).has_value();
    side.open =
        static_cast<double>(space_.explore(side.place_m).direct) > 0.9 * SpaceExplorer::kWalks;
  }
  if (sides[0].inaudible == sides[1].inaudible && sides[0].open == sides[1].open)
    return std::nullopt;
  const bool second = sides[0].inaudible || (sides[0].open && !sides[1].inaudible);
  return InaudiblePlace{
      InaudibleCause::kOnSurface, 0, rounded_to_cm(sides[second ? 1 : 0].place_m), {}};
}

// Fast conservative test: true for every point that judge() may reject.
bool Audibility::looks_suspicious(const Vec3& place_m) const {
  constexpr std::uint32_t kRays = 16, kMany = 10;
  std::uint32_t near = 0, behind = 0, escaped = 0, at_surface = 0;
  for (std::uint32_t i = 0; i < kRays; ++i) {
    const auto hit = space_.scene().intersect(place_m, spread_direction(i, kRays));
    near += hit && hit->distance_m < 2 * kNarrow_m;
    behind += hit && hit->from_behind;
    escaped += !hit;
  }
  for (std::uint32_t i = 0; i < 4; ++i) {
    const Vec3 off = spread_direction(i, 4);
    const auto hit = space_.scene().intersect(place_m + kSurface_m * off, -off);
    at_surface += hit && hit->distance_m <= kSurface_m + 2 * kAtSurface_m;
  }
  return near >= kMany || behind >= kMany || at_surface >= 3 ||
         (space_.is_closed() && escaped >= kRays * kOutsideEscapes / 2);
}

std::vector<InaudibleEmitter> Audibility::inaudible(std::span<const Emitter> emitters) const {
  std::vector<InaudibleEmitter> found;
  if (space_.is_empty()) return found;
  std::vector<std::size_t> indices(emitters.size());
  for (std::size_t i = 0; i < indices.size(); ++i) indices[i] = i;
  std::vector<Vec3> fine_m;  // points near audible emitters
  std::size_t explored = 0;
  for (const std::size_t i : thinned<std::size_t>(indices, kMaxEmitters)) {
    const Vec3& place_m = emitters[i].position_m;
    if (!looks_suspicious(place_m)) continue;
    auto bad = judge_on_surface(place_m);
    if (!bad && std::none_of(fine_m.begin(), fine_m.end(),
                             [&](const Vec3& other_m) { return space_.sees(place_m, other_m); })) {
      if (++explored > kMaxExplored) break;
      bad = judge(place_m);
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
  if (space_.is_empty()) return lit_m;
  for (const Emitter& emitter : some)
    for (const Vec3& point_m :
         thinned<Vec3>(space_.explore(emitter.position_m).points_m, kLitPlaces / some.size()))
      lit_m.push_back(point_m);
  return lit_m;
}

// The emitters and the space that listeners are judged by.
struct Audibility::Listening {
  Listening(const Audibility& of, std::span<const Emitter> all, const Air& air)
      : audibility(of),
        emitters(all),
        lit_m(of.lit_places_m(all)),
        some_lit_m(thinned<Vec3>(lit_m, kPairs)) {
    const Bands loss_per_m = air_loss_per_m(air);
    min_loss_per_m = *std::min_element(loss_per_m.begin(), loss_per_m.end());
  }

  bool hears(const Vec3& place_m) const {
    return audibility.space_.any_sees(std::span(&place_m, 1), lit_m);
  }

  bool is_far_away(const Vec3& place_m) const {
    double energy = 0;
    for (const Emitter& emitter : emitters) {
      // Reflections are louder than the direct sound by at most this distance ratio.
      const double away_m =
          std::max(1.0, length(place_m - emitter.position_m) - audibility.space_.extent_m());
      const double amplitude = emitter.gain / away_m;
      energy += amplitude * amplitude * exp_of(-min_loss_per_m * away_m);
    }
    return energy < kInaudible;
  }

  std::optional<Vec3> nearest_that_hears(const Vec3& place_m) const {
    const SpaceExplorer& space = audibility.space_;
    if (space.is_empty()) {
      Vec3 path_m = place_m - emitters[0].position_m;
      path_m =
          path_m / std::max({std::abs(path_m.x), std::abs(path_m.y), std::abs(path_m.z), 1e-9});
      return rounded_to_cm(emitters[0].position_m + 2.0 * normalize(path_m));
    }
    for (const Vec3& other_m : space.candidates_m(place_m))
      if (space.has_clearance(other_m) && space.any_sees(std::span(&other_m, 1), some_lit_m))
        return other_m;
    return std::nullopt;
  }

  // All emitters, if none can be heard anywhere: the cause of the first of them.
  std::optional<InaudiblePlace> cause_of_silence() const {
    const std::vector<Emitter> some = thinned<Emitter>(emitters, kLitEmitters);
    const auto silent = audibility.inaudible(some);
    if (silent.size() != some.size()) return std::nullopt;
    InaudiblePlace cause = silent[0].place;
    cause.emitter = static_cast<std::size_t>(
        std::find(emitters.begin(), emitters.end(), some[silent[0].emitter]) - emitters.begin());
    return cause;
  }

  const Audibility& audibility;
  std::span<const Emitter> emitters;
  std::vector<Vec3> lit_m, some_lit_m;
  double min_loss_per_m = 0;
};

std::optional<InaudiblePlace> Audibility::judge_listener(const Vec3& place_m,
                                                         const Listening& to) const {
  if (to.is_far_away(place_m)) {
    const bool silent = std::all_of(to.emitters.begin(), to.emitters.end(),
                                    [](const Emitter& emitter) { return !(emitter.gain > 0); });
    if (silent) return std::nullopt;
    return InaudiblePlace{InaudibleCause::kFarAway, 0, to.nearest_that_hears(place_m), {}};
  }
  if (space_.is_empty()) return std::nullopt;
  if (const auto normal = space_.surface_at(place_m, kOnSurface_m)) {
    InaudiblePlace found{InaudibleCause::kOnSurface, 0, {}, {}};
    for (const double side_m : {kOffSurface_m, -kOffSurface_m}) {
      const Vec3 beside_m = rounded_to_cm(place_m + side_m * *normal);
      if (!found.alternative_m && to.hears(beside_m)) found.alternative_m = beside_m;
    }
    return found;
  }
  if (to.hears(place_m) ||
      space_.any_sees(thinned<Vec3>(space_.explore(place_m).points_m, kPairs), to.some_lit_m))
    return std::nullopt;

  auto inaudible = judge(place_m);
  if (!inaudible) {
    if (auto cause = to.cause_of_silence()) return cause;
    if (std::any_of(to.some_lit_m.begin(), to.some_lit_m.end(),
                    [&](const Vec3& lit_m) { return space_.bends_to(place_m, lit_m); }))
      return std::nullopt;
    inaudible = InaudiblePlace{InaudibleCause::kShutOff, 0, {}, {}};
  }
  inaudible->alternative_m = to.nearest_that_hears(place_m);
  return inaudible;
}

std::vector<std::optional<InaudiblePlace>> Audibility::inaudible_at(
    std::span<const Vec3> listeners_m, std::span<const Emitter> emitters, const Air& air) const {
  std::vector<std::optional<InaudiblePlace>> answers(listeners_m.size());
  if (emitters.empty()) return answers;
  const Listening to(*this, emitters, air);
  for (std::size_t i = 0; i < listeners_m.size(); ++i)
    answers[i] = judge_listener(listeners_m[i], to);
  return answers;
}

}  // namespace clamor
