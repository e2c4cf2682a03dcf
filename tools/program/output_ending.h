// output_ending.h: checks that the name of an output says what it is, like "-o room.clamor".
#pragma once

#include <string>
#include <string_view>

#include "common/result.h"

namespace clamor {

// An Error unless the path ends so, or is a device or a pipe. `kind`: "bake files", for the
// message. Call it once it is known that the path is none of the inputs.
Result<void> check_ending(const std::string& path, std::string_view ending, std::string_view kind);

}  // namespace clamor
