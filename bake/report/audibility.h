// audibility.h: can anything be heard at a place, and if not, why not and where could it be?
//
// An emitter in a pillar or forty metres outside a closed hall, and a listener there, are mistakes
// that nothing else tells: the bake succeeds, and the render is silent. This follows sound roughly,
// by some thousand rays that are reflected diffusely and pass surfaces that let sound through.
//
//   in a solid    rays from the place hardly get away from it, and either the surfaces are too near
//                 for any room, or rays meet them from behind and they are nearer than those of
//                 rooms or stand in one
//   outside       most of the level's bounds are closed in, rays from the place are not, and no
//                 surface that they meet is in sight of the closed space
//   on a surface  half of an emitter's sound leaves on the far side, and of a listener's rays
//   chance
//                 decides on which side they begin
//   far away      the direct sound has fallen by 120 dB from its level at 1 m
//   shut off      none of these, but no path from an emitter was found, nor one that bends
//
// The search prefers silence to a false alarm: a place that any ray connects with an emitter is
// fine. Everything is a function of the input alone; the random numbers are always the same.
//
// Threads: const functions from any number at once.   Cost: milliseconds for a place that is fine.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "bake/trace/scene.h"
#include "common/air.h"
#include "common/material.h"
#include "common/vec.h"
#include "formats/level/level.h"

namespace clamor {

enum class InaudibleCause : std::uint8_t { kInSolid, kOutside, kOnSurface, kFarAway, kShutOff };

struct InaudiblePlace {
  InaudibleCause why{};
  double width_m = 0;  // of the hollow, for kInSolid: between its surfaces on average
  std::optional<Vec3> alternative_m{};  // the nearest place found that works
  std::optional<std::size_t>
      emitter{};  // set if an emitter's place is to blame, not the listener's
};

struct InaudibleEmitter {
  std::size_t emitter = 0;  // its index
  InaudiblePlace place;
};

class Audibility {
 public:
  // Mesh, materials and scene must outlive it; the scene is made of the mesh.
  Audibility(const Scene& scene, const Mesh& mesh, std::span<const Material> materials);

  // Finds the emitters whose sound does not get where listeners are; none in a level without
  // surfaces.
  std::vector<InaudibleEmitter> unheard(std::span<const Emitter> emitters) const;

  // Why a listener at each place hears nothing of any of the emitters; nothing where they do.
  std::vector<std::optional<InaudiblePlace>> inaudible_at(std::span<const Vec3> listeners_m,
                                                          std::span<const Emitter> emitters,
                                                          const Air& air) const;

 private:
  struct Exploration;
  struct AirPlace {
    Vec3 place_m{};
    bool closed_in = false;
  };
  // A space that may be the inside of a solid, by how sure that is.
  enum class Hollow : std::uint8_t { kNone, kNarrow, kThick, kWide };

  Exploration explore(const Vec3& from_m) const;
  bool transmits(std::uint16_t material) const;
  bool sees(const Vec3& from_m, const Vec3& to_m) const;
  bool bends_to(const Vec3& from_m, const Vec3& to_m) const;
  bool connected(std::span<const Vec3> some_m, std::span<const Vec3> others_m) const;
  bool has_clearance(const Vec3& place_m) const;
  double share_of_bounds(const Exploration& found) const;
  std::vector<Vec3> grid_m() const;
  std::vector<Vec3> candidates_m(const Vec3& from_m) const;
  std::optional<InaudiblePlace> judged(const Vec3& place_m) const;
  std::optional<Vec3> surface_at(const Vec3& place_m, double within_m) const;
  std::optional<InaudiblePlace> judged_on_surface(const Vec3& place_m) const;
  Hollow hollow_of(const Exploration& found) const;
  std::optional<AirPlace> nearest_air(const Vec3& from_m) const;
  std::vector<Vec3> lit_places_m(std::span<const Emitter> emitters) const;
  bool looks_suspicious(const Vec3& place_m) const;

  const Scene& scene_;
  std::span<const Material> materials_;
  Vec3 low_m_{}, high_m_{};     // of the triangles
  bool empty_ = true;           // there are no triangles
  bool closed_ = false;         // most of the bounds are closed in
  std::vector<Vec3> inside_m_;  // some places in the closed space
};

// "'violin' is inside a solid ...": one sentence without a full stop for each of the first few
// emitters, and one for all others.
std::vector<std::string> in_words(std::span<const InaudibleEmitter> unheard,
                                  std::span<const Emitter> emitters);

// "nothing is heard at 1,1.7,3: ...".
std::string in_words(const InaudiblePlace& unheard, const Vec3& listener_m,
                     std::span<const Emitter> emitters);

}  // namespace clamor
