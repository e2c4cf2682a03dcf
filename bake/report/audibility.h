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

#include "bake/report/space_explorer.h"
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
  std::vector<InaudibleEmitter> inaudible(std::span<const Emitter> emitters) const;

  // For each position, the reason why a listener there hears none of the emitters, or nothing if
  // one is audible.
  std::vector<std::optional<InaudiblePlace>> inaudible_at(std::span<const Vec3> listeners_m,
                                                          std::span<const Emitter> emitters,
                                                          const Air& air) const;

 private:
  struct AirPlace {
    Vec3 place_m{};
    bool is_enclosed = false;
  };
  // Kinds of cavities that may be the inside of a solid, most certain first after kNone.
  enum class Cavity : std::uint8_t { kNone, kNarrow, kThick, kWide };
  struct Listening;

  Cavity cavity_of(const Exploration& found) const;
  std::optional<AirPlace> nearest_air(const Vec3& from_m) const;
  std::optional<InaudiblePlace> judge(const Vec3& place_m) const;
  std::optional<InaudiblePlace> judge_on_surface(const Vec3& place_m) const;
  std::optional<InaudiblePlace> judge_listener(const Vec3& place_m, const Listening& to) const;
  bool looks_suspicious(const Vec3& place_m) const;
  std::vector<Vec3> lit_places_m(std::span<const Emitter> emitters) const;

  SpaceExplorer space_;
};

}  // namespace clamor
