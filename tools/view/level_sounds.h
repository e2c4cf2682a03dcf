// level_sounds.h: sound files that emitters of a level can play: those in its folder.
//
// A sidecar names a sound by its path from the level's folder, so that the folder can be moved.
#pragma once

#include <string>
#include <vector>

#include "common/result.h"

namespace clamor {

// The sound files in the level's folder and two folders deep below it, by their paths from there,
// sorted; at most 200.
std::vector<std::string> sounds_beside(const std::string& level_path);

// The name by which a sidecar of the level refers to a file, given by a path from the level's
// folder, the current folder or the root. Errors: it is not there, lies outside the level's folder,
// or is no sound.
Result<std::string> sound_of_level(const std::string& level_path, const std::string& file);

}  // namespace clamor
