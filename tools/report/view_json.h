// view_json.h: what the page's view of a level draws, as JSON.
#pragma once

#include <cstddef>
#include <span>

#include "common/result.h"
#include "tools/analysis/json_values.h"
#include "tools/report/floor_map.h"
#include "tools/report/level_findings.h"
#include "tools/report/room.h"

namespace clamor {

// Upper bounds of what is drawn: a page of 5 MB. Where a level has more, the page says so.
struct ViewLimits {
  std::size_t sources = 24'576;    // reflections of highest key: the octree's top
  std::size_t triangles = 54'000;  // the largest
  std::size_t nodes = 2048;        // whole depths, from the top down
  std::size_t emitters = 20'000;
};

// Findings, map and listeners are relative to the level's origin, all else is in the file.
Result<OrderedJson> view_json(const Room& room, std::span<const LevelFinding> findings,
                              const FloorMap& map, std::span<const Vec3> listeners_m,
                              const ViewLimits& limits = {});

}  // namespace clamor
