// walk_file.h: a scripted path of a listener, as `--walk PATH.json` takes it.
//
//   { "loop": false,
//     "points": [ { "time_s": 0, "position_m": [0, 1.7, 3], "yaw_deg": 0, "pitch_deg": 0 }, ... ] }
//
// Positions and angles are linear between points (yaw takes the shorter way round) and still
// beyond the last.
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

  // The same as part of another file; `where` names it in messages.
  static Result<Walk> parse(const Json& json, const std::string& where);

  // A listener who stands still.
  static Walk standing(const Listener& pose);

  Listener at(double time_s) const;
  double length_s() const;

 private:
  struct Point {
    double time_s;
    Listener pose;
  };
  std::vector<Point> points_;
  bool loop_ = false;
};

}  // namespace clamor
