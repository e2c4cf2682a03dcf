// audibility_warnings.h: warns of a listener who hears nothing of a bake, or moving sources without
// their room, and says why.
#pragma once

#include <cstddef>
#include <optional>
#include <string>

#include "formats/bake_file/bake_file.h"
#include "formats/level/walk_file.h"
#include "runtime/sampling/moving_sources.h"

namespace clamor {

struct AudibilityQuery {
  double seconds = 0;                    // the part of the walk that is checked
  std::optional<std::size_t> emitter{};  // only this emitter sounds; unset: all
  bool with_occlusion = true;            // false: only distance makes it inaudible
};

// Returns a sentence, or nothing if something is heard all along the walk, which is tested at up to
// 33 positions. Reads the geometry; if that fails, nothing is returned, because the caller reports
// the failure when it reads the geometry itself.
std::optional<std::string> audibility_warning(const BakeFile& file, const Walk& walk,
                                              const AudibilityQuery& question);

// Returns a sentence if moving sources are to reverberate in a bake that has no probes.
std::optional<std::string> reverberation_warning(const BakeFile& file, const MovingOptions& moving);

}  // namespace clamor
