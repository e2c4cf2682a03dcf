// moving_script.h: moving sources and movable parts that follow a file, as `--moving FILE.json`
// takes it.
//
//   { "sources": [
//       { "name": "car", "signal": "engine.wav", "gain_db": -6, "directivity": 1,
//         "reverberation_db": -3,
//         "from_s": 2, "until_s": 12,
//         "path": { "points": [ { "time_s": 2, "position_m": [-40, 1, 5] },
//                               { "time_s": 6, "position_m": [80, 1, 5], "yaw_deg": -90 } ] } } ],
//     "parts": [ { "name": "Door", "points": [ { "time_s": 2 }, { "time_s": 3, "yaw_deg": 90 } ] }
//     ],
//     "portals": [ { "name": "Door", "openness": [[0, 1], [4, 1], [5, 0]] } ] }
//
// `signal` is "noise", "impulse" or the URI of a sound file within the script's folder, as in a
// level (level_folder.h). The signal begins at `from_s` and repeats unless "loop" is false. A loop
// from 0 on has always been playing. `path` is a walk (walk_file.h); the source's axis points where
// a walking listener would look. Defaults: gain 0 dB, directivity 0, from 0 to the end; reflections
// (of the bake's probes) at 0 dB, and none at -200. Lists may be missing, but not all;
// part_script.h documents the parts, portal_script.h the portals.
#pragma once

#include <string>
#include <vector>

#include "common/result.h"
#include "formats/files/output_target.h"
#include "formats/level/walk_file.h"
#include "runtime/sampling/moving_sources.h"
#include "runtime/sampling/part_script.h"
#include "runtime/sampling/portal_script.h"

namespace clamor {

class Json;
class SignalTable;

class MovingScript {
 public:
  static Result<MovingScript> read(const std::string& path);

  // Options for the auralizer, for a bake with so many signals.
  MovingOptions options(std::size_t signals_of_bake) const;

  // The script and its sound files, which no output may overwrite.
  const InputFiles& files() const { return files_; }

  bool has_sources() const { return !sources_.empty(); }
  PortalScript& portals() { return portals_; }
  const PartScript& parts() const { return parts_; }

  // Calls visit(name, path, from_s, until_s) for each source.
  template <class Visit>
  void for_each_path(const Visit& visit) const {
    for (const ScriptedSource& one : sources_) visit(one.name, one.path, one.from_s, one.until_s);
  }

  // Commits the state of sources and parts at a time. Times must not decrease from call to call.
  // `moving` may be null if there are no sources.
  Result<void> apply(MovingSources* moving, const PartScript::Stage& stage, double time_s);

 private:
  struct ScriptedSource {
    std::string name;
    std::uint32_t signal = 0;  // of signals_
    double gain = 1, reverberation = 1, directivity = 0, from_s = 0, until_s = 0;
    Walk path;
    MovingHandle handle;
    bool is_present = false;
  };
  Result<void> read_source(const Json& json, const std::string& where, const std::string& path,
                           SignalTable& signals);
  Result<void> apply(MovingSources& moving, double time_s);

  std::vector<ScriptedSource> sources_;
  PartScript parts_;
  std::vector<Signal> signals_;
  InputFiles files_;
  PortalScript portals_;
};

}  // namespace clamor
