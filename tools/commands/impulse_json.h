// impulse_json.h: the JSON of clamor impulse, whose keys tools/README.md documents.
#pragma once

#include <span>
#include <string>

#include "tools/commands/impulse_output.h"

namespace clamor {

// One place alone, or a list with names.
std::string impulse_json(std::span<const MeasuredPlace> all);

}  // namespace clamor
