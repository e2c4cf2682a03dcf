// moving_script.h: moving sources that follow a file, as `--moving FILE.json` takes it.
//
//   { "sources": [
//       { "name": "car", "signal": "engine.wav", "gain_db": -6, "directivity": 1,
//         "from_s": 2, "until_s": 12,
//         "path": { "points": [ { "time_s": 2, "position_m": [-40, 1, 5] },
//                               { "time_s": 6, "position_m": [80, 1, 5], "yaw_deg": -90 } ] } } ] }
//
// `signal` is "noise", "impulse" or the URI of a sound file within the script's folder, as in a
// level (level_folder.h). The signal begins at `from_s` and repeats unless "loop" is false. A loop
// from 0 on has always been playing. `path` is a walk (walk_file.h); the source's axis points where
// a walking listener would look. Defaults: gain 0 dB, directivity 0, from 0 to the end.
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

  // Options for the auralizer, for a bake with so many signals.
  MovingOptions options(std::size_t signals_of_bake) const;

  // The script and its sound files, which no output may overwrite.
  const InputFiles& files() const { return files_; }

  // Commits the sources' state at a time. Times must not decrease from call to call.
  Result<void> apply(MovingSources& moving, double time_s);

 private:
  struct ScriptedSource {
    std::string name;
    std::uint32_t signal = 0;  // of signals_
    double gain = 1, directivity = 0, from_s = 0, until_s = 0;
    Walk path;
    MovingHandle handle;
    bool is_present = false;
  };
  std::vector<ScriptedSource> sources_;
  std::vector<Signal> signals_;
  InputFiles files_;
};

}  // namespace clamor
