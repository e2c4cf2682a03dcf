// portal_script.h: how open portals are over time, the "portals" of a script (moving_script.h).
//
//   "portals": [ { "name": "Door", "openness": [[0, 1], [4, 1], [5, 0]] } ]
//
// Each point is a time in seconds and an openness, 0 (closed) to 1. It is linear between points,
// and constant before the first and after the last. It takes the place of what the movable parts of
// the portal would do.
#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <vector>

#include "common/result.h"
#include "formats/files/json.h"
#include "formats/level/portal.h"

namespace clamor {

class PortalScript {
 public:
  static Result<PortalScript> parse(const Json& list, const std::string& where);

  bool is_empty() const { return portals_.empty(); }

  // Finds the portals of a level by name: all that have it. An Error if there is none. Call it
  // before openness().
  Result<void> find(std::span<const Portal> portals);

  // By index of the level's portals; kOpenedByParts for those that the script does not name.
  std::vector<float> openness(double time_s) const;

 private:
  struct Point {
    double time_s = 0, openness = 1;
  };
  struct Scripted {
    std::string name, where;
    std::vector<Point> points;
    std::vector<std::size_t> portals;  // indices
  };
  std::vector<Scripted> portals_;
  std::size_t portals_of_level_ = 0;
};

}  // namespace clamor
