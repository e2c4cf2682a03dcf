// level_doors.h: the doors of a level, as the window opens and closes them: its movable parts, and
// the portals that no part opens.
//
// A part that is moved turns about its pivot or slides, from where the level has it to where its
// motion ends; the level does not say how, so that is guessed from its shape and may be changed.
// Portals that parts open follow them in the runtime (formats/level/portal_coupling.h). None of it
// is saved: how open a door is, is the game's.
#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <vector>

#include "formats/level/movable_part.h"
#include "formats/level/portal.h"

namespace clamor {

// How a part moves: it turns about +Y at its pivot, and shifts.
struct PartMotion {
  double turn_deg = 0;
  Vec3 shift_m{};
  bool operator==(const PartMotion&) const = default;
};

// A part whose pivot is at its side is a door on hinges and turns by 90 degrees; another one slides
// aside by its own width.
PartMotion guessed_motion(const MovablePart& part);

// The pose after a share of the motion.
PartPose moved(const PartPose& rest, const PartMotion& motion, double share);

class LevelDoors {
 public:
  struct Part {
    std::string name;
    Vec3 rest_m{};  // in the world
    PartMotion motion;
    double share = 0, target = 0;  // of the motion
    bool operator==(const Part&) const = default;
  };
  struct Opening {
    std::string name;
    Vec3 centre_m{};  // in the world
    double openness = 1, target = 1;
    bool operator==(const Opening&) const = default;
  };

  // Takes over the parts and portals of a level. Those that were there before, by name and place,
  // stay as open as they were.
  void update(std::span<const MovablePart> parts, std::span<const Portal> portals,
              const Vec3& origin_m);

  const std::vector<Part>& parts() const { return parts_; }
  const std::vector<Opening>& portals() const { return portals_; }

  // They move to it within a second.
  void move_part(std::size_t part, double share) { parts_[part].target = share; }
  void open_portal(std::size_t portal, double openness) { portals_[portal].target = openness; }
  void set_motion(std::size_t part, const PartMotion& motion) { parts_[part].motion = motion; }

  // Returns whether anything has moved, or was changed, since the last call.
  bool advance(double seconds);

  // How the parts and portals of a bake of the level stand: those of the same name and place, and
  // at rest and open what the level does not have; kOpenedByParts for portals that have parts.
  PartPose pose_of(const MovablePart& part, const Vec3& origin_m) const;  // relative to the origin
  std::vector<float> openness_of(std::span<const Portal> portals, const Vec3& origin_m) const;

 private:
  std::vector<Part> parts_, told_parts_;  // told: by the last advance()
  std::vector<Opening> portals_, told_portals_;
};

}  // namespace clamor
