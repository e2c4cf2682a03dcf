// level_doors.h: the doors of a level, as the window opens and closes them: its movable parts, and
// the portals that no part opens; and the rectangles of doorways, for new portals.
//
// A part that is moved turns about its pivot or slides, from where the level has it to where its
// motion ends; the level does not say how, so that is guessed from its shape and may be changed.
// Portals that parts open follow them in the runtime (formats/level/portal_coupling.h). Openness
// is not saved: the game sets it.
#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "common/vec.h"
#include "formats/level/mesh.h"
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
  // A part, or a portal that has no parts.
  struct Door {
    std::string name;
    Vec3 place_m{};                // in the world, where the level has it
    double share = 0, target = 0;  // of a part's motion, or of a portal that is open
    PartMotion motion{};
    bool operator==(const Door&) const = default;
  };

  // Takes over the parts and portals of a level. Doors that the level had before, by name and
  // place, stay as open as they were.
  void update(std::span<const MovablePart> parts, std::span<const Portal> portals,
              const Vec3& origin_m);

  const std::vector<Door>& parts() const { return parts_; }
  const std::vector<Door>& portals() const { return portals_; }

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
  std::vector<Door> parts_, portals_;
  std::vector<Door> told_parts_, told_portals_;  // by the last advance()
};

// The opening that someone at `eye_m` looks through: a hole in a wall ahead, up to 8 m away and 6 m
// wide and high, in the middle of the wall's thickness. Nothing if there is no such wall. Some
// hundred rays, each linear in the number of triangles: a click has time.
std::optional<Portal> doorway_ahead(const Mesh& mesh, const Vec3& eye_m, const Vec3& direction);

// A rectangle of the size of a door, ahead of someone at `eye_m` who stands.
Portal usual_doorway(const Vec3& eye_m, const Vec3& direction);

// The rectangle that a part fills where the level has it: across its thinnest side.
Portal doorway_of(const MovablePart& part);

// The edge of a portal, and slats across it, the more the further it is closed. Two points for each
// line.
std::vector<Vec3f> lines_of(const Portal& portal, double openness);

}  // namespace clamor
