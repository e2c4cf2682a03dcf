// audibility.h: detects emitters and listeners that nobody can hear, and proposes other positions.
//
// An emitter inside a pillar, or forty metres outside a closed hall, is a mistake that nothing else
// reports: the bake succeeds and the render is silent. The check follows sound roughly, with some
// thousand rays that are reflected diffusely and pass transmitting surfaces. The causes:
//
//   in a solid    walks from the point stay enclosed, and either the cavity is too small for a
//   room,
//                 or its surfaces are seen from behind and it is smaller than rooms are or stands
//                 in one
//   outside       most of the level's bounds are enclosed, the point is not, and no surface that
//   its
//                 walks hit is visible from the enclosed space
//   on a surface  half of an emitter's sound leaves on the far side; a listener's rays start on
//   either
//                 side by chance
//   far away      the direct sound is 120 dB below its level at 1 m
//   shut off      none of these, but neither a path nor diffraction from any emitter was found
//
// The check avoids false alarms: a point that any ray connects with an emitter passes. The random
// numbers are fixed, so results depend on the input alone.
//
// Threads: const functions may be called concurrently. Cost: milliseconds for a point that passes.
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
#include "formats/level/emitter.h"
#include "formats/level/mesh.h"

namespace clamor {

enum class InaudibleCause : std::uint8_t { kInSolid, kOutside, kOnSurface, kFarAway, kShutOff };

struct InaudiblePlace {
  InaudibleCause why{};
  double width_m = 0;                   // mean free path inside the solid, for kInSolid
  std::optional<Vec3> alternative_m{};  // nearest point found that passes
  std::optional<std::size_t>
      emitter{};  // set if that emitter's position is to blame, not the listener's
};

struct InaudibleEmitter {
  std::size_t emitter = 0;  // index in the level
  InaudiblePlace place;
};

class Audibility {
 public:
  // Mesh, materials and scene must outlive the object; the scene must be built from the mesh.
  Audibility(const Scene& scene, const Mesh& mesh, std::span<const Material> materials);

  // Finds emitters that cannot be heard where listeners are. Levels without surfaces have none.
  std::vector<InaudibleEmitter> unheard(std::span<const Emitter> emitters) const;

  // For each position, the reason why a listener there hears none of the emitters, or nothing if
  // one is audible.
  std::vector<std::optional<InaudiblePlace>> inaudible_at(std::span<const Vec3> listeners_m,
                                                          std::span<const Emitter> emitters,
                                                          const Air& air) const;

 private:
  struct Exploration;
  struct AirPlace {
    Vec3 place_m{};
    bool closed_in = false;
  };
  // Kinds of cavities that may be the inside of a solid, most certain first after kNone.
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
  Vec3 low_m_{}, high_m_{};     // bounds of the triangles
  bool empty_ = true;           // whether there are no triangles
  bool closed_ = false;         // whether most of the bounds are enclosed
  std::vector<Vec3> inside_m_;  // sample points of the enclosed space
};

// Describes inaudible emitters: a sentence without full stop for each of the first few, as in
// "'violin' is inside a solid ...", and one for all others.
std::vector<std::string> in_words(std::span<const InaudibleEmitter> unheard,
                                  std::span<const Emitter> emitters);

// Describes an inaudible listener position, as in "nothing is heard at 1,1.7,3: ...".
std::string in_words(const InaudiblePlace& unheard, const Vec3& listener_m,
                     std::span<const Emitter> emitters);

}  // namespace clamor
