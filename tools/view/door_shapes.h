// door_shapes.h: rectangles of doorways for new portals, and what the window draws of portals.
#pragma once

#include <optional>
#include <vector>

#include "common/vec.h"
#include "formats/level/mesh.h"
#include "formats/level/movable_part.h"
#include "formats/level/portal.h"

namespace clamor {

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
