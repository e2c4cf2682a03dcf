// level_origin.h: where a level has its own origin, because it lies far from the world's.
//
// Vertices and sources are single-precision numbers, which are 0.06 mm apart at 1 km and 6 cm at
// 1000 km. So everything in a Level and in a bake file is relative to a place in its middle: that
// is subtracted in double precision while the level is read. Users and games see the world's
// coordinates alone: listeners, moving sources and parts lose the origin where they enter the
// runtime (auralizer.h), and places in messages and tables regain it where they are printed.
#pragma once

#include <string>

#include "common/vec.h"

namespace clamor {

// Coordinates in the world; those of grids such as UTM, LV95 and EPSG:4647 are within it.
inline constexpr double kMaxWorldCoordinate_m = 1e8;

// A place of the world relative to a level's origin, but at most 1000 km from it in each direction,
// as far as numbers in a level go: nothing is heard from there. A place that is out of the world's
// range stays out of range.
Vec3 in_level(const Vec3& place_m, const Vec3& origin_m);

// A place as messages tell it and options take it: "1,1.7,-3".
std::string place_in_words(const Vec3& place_m);

// The origin of a level with this middle: whole hundreds of metres, so that a level that is moved
// by whole hundreds keeps its numbers. 0 within 500 m, and for a middle out of range.
Vec3 level_origin_m(const Vec3& middle_m);

}  // namespace clamor
