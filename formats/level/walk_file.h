// walk_file.h: a scripted listener path, for `--walk PATH.json`.
//
//   { "loop": false,
//     "points": [ { "time_s": 0, "position_m": [0, 1.7, 3],
//                   "yaw_deg": 0, "pitch_deg": 0, "roll_deg": 0 }, ... ] }
//
// Angles are those of HeadAngles (listener.h) and 0 by default. Positions and angles are linear
// between points, with yaw and roll along the shorter arc, and constant after the last point. Two
// points at one time are a jump.
#pragma once

#include <string>
#include <vector>

#include "common/listener.h"
#include "common/result.h"

namespace clamor {

class Json;

class Walk {
 public:
  static Result<Walk> read(const std::string& path);

  // Parses a walk within another file; `where` names it in messages.
  static Result<Walk> parse(const Json& json, const std::string& where);

  // A listener at rest.
  static Walk standing(const Listener& listener);

  Listener at(double time_s) const;
  double length_s() const;

 private:
  struct Point {
    double time_s;
    Listener listener;
    HeadAngles angles;  // of the listener, for interpolation
  };
  std::vector<Point> points_;
  bool loop_ = false;
};

}  // namespace clamor
