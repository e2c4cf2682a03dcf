// listening_scripts.h: what a report needs to sound: the player of @clamor/player and a bake, as
// elements of the page.
#pragma once

#include <string>

#include "common/result.h"

namespace clamor {

// `player` is the folder of the npm package, as `tools/bundle --wasm` or npm leave it. `other` is
// another bake, to be heard at the same places, or "".
Result<std::string> listening_scripts(const std::string& player, const std::string& bake,
                                      const std::string& other);

}  // namespace clamor
