// moving_script.h: moving sources that follow a file, as `--moving FILE.json` takes it.
//
//   { "sources": [
//       { "name": "car", "signal": "engine.wav", "gain_db": -6, "directivity": 1,
//         "from_s": 2, "until_s": 12,
//         "path": { "points": [ { "time_s": 2, "position_m": [-40, 1, 5] },
//                               { "time_s": 6, "position_m": [80, 1, 5], "yaw_deg": -90 } ] } } ] }
//
// `signal` is "noise", "impulse" or the URI of a sound file in the script's folder, which a script
// cannot leave, just as a level cannot leave its own (level_folder.h). It begins at `from_s`, is
// heard from its first sample on and, unless "loop" is false, goes on. A loop from 0 on has always
// been playing. `path` is a walk's (walk_file.h): the source faces where a
// walker would look. Unset: gain 0 dB, directivity 0, from 0 to the end.
#pragma once

#include <string>
#include <vector>

#include "common/result.h"
#include "formats/files/output_target.h"
#include "formats/level/walk_file.h"
#include "runtime/sampling/moving_sources.h"

namespace clamor {

class MovingScript {
 public:
  static Result<MovingScript> read(const std::string& path);

  // What an auralizer needs to be made with, for a bake that has so many signals.
  MovingOptions options(std::size_t signals_of_bake) const;

  // The script itself and the sounds that it names, which no output may replace.
  const InputFiles& files() const { return files_; }

  // Has all that the file says be so at a time. Calls must go forward in time.
  Result<void> apply(MovingSources& moving, double time_s);

 private:
  struct Actor {
    std::string name;
    std::uint32_t signal = 0;  // of signals_
    double gain = 1, directivity = 0, from_s = 0, until_s = 0;
    Walk path;
    MovingHandle handle;
    bool on_stage = false;
  };
  std::vector<Actor> actors_;
  std::vector<Signal> signals_;
  InputFiles files_;
};

}  // namespace clamor
