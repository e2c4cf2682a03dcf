// audibility_warnings.h: whether the listener of a command hears anything of a bake, and why not.
#pragma once

#include <cstddef>
#include <optional>
#include <string>

#include "formats/bake_file/bake_file.h"
#include "formats/level/walk_file.h"

namespace clamor {

struct AudibilityQuery {
  double seconds = 0;                    // of the walk that are of interest
  std::optional<std::size_t> emitter{};  // that alone sounds; unset: all of them
  bool with_occlusion = true;            // false: only distance can make it silent
};

// One sentence, or nothing where something is heard all along the walk. A walk is asked about at up
// to 33 places. Reads the geometry; where that cannot be read, nothing is said, because whoever
// needs it reports that.
std::optional<std::string> audibility_warning(const BakeFile& file, const Walk& walk,
                                              const AudibilityQuery& question);

}  // namespace clamor
