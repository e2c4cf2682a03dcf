// part_script.h: movable parts that follow a file: the "parts" of moving_script.h.
//
//   "parts": [
//     { "name": "Door", "points": [ { "time_s": 2 }, { "time_s": 3, "yaw_deg": 90 } ] },
//     { "name": "crate", "box_m": [1, 1, 1], "transmission": 0.01,
//       "points": [ { "time_s": 0, "position_m": [0, 0.5, 3], "yaw_deg": 30 } ] } ]
//
// Without "box_m", which are the lengths of the edges of a box to add, `name` is that of a part of
// the level. `yaw_deg` about +Y, `pitch_deg` about +X and `roll_deg` about -Z turn it from how it
// is at rest, about its pivot; `position_m` is where the pivot is, by default where it is at rest
// or where the point before has it. Positions are linear between points, and rotations take the
// shorter arc (slerp); two points at one time are a jump. Before the first point and after the last
// a part is where these have it. Boxes absorb a tenth, or what they transmit if
// that is more, and reflect the rest.
#pragma once

#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "common/result.h"
#include "common/vec.h"
#include "formats/level/movable_part.h"
#include "runtime/occlusion/moving_parts.h"

namespace clamor {

class Json;
class PartShape;

class PartScript {
 public:
  // Parses the list; `where` names the file in messages.
  static Result<PartScript> parse(const Json& json, const std::string& where);

  bool empty() const { return parts_.empty(); }
  bool adds_parts() const;

  // An error if the level lacks a part.
  Result<void> check(std::span<const MovablePart> of_level) const;

  // The parts of a level, with their handles by index, and all that move.
  struct Stage {
    MovingParts* parts = nullptr;  // null: nothing occludes
    std::span<const PartHandle> handles;
    std::span<const MovablePart> of_level;
    Vec3 origin_m{};  // of the level, to which the poses of its parts are relative
  };
  // Moves the parts to their poses at a time.
  Result<void> apply(const Stage& stage, double time_s);

 private:
  struct Point {
    double time_s = 0;
    std::optional<Vec3> position_m;  // none: at rest
    Quaternion turn{1, 0, 0, 0};
  };
  struct Part {
    std::string name;
    std::shared_ptr<const PartShape> box;  // null: a part of the level
    std::vector<Point> points;
    PartHandle handle{};  // of a box, once it is added

    PartPose at(double time_s, const PartPose& rest) const;
  };
  static Result<Part> parse_part(const Json& json, const std::string& where);
  static Result<std::vector<Point>> parse_points(const Json& json, const std::string& where);

  std::vector<Part> parts_;
};

}  // namespace clamor
