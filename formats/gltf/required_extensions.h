// required_extensions.h: whether a level can be baked without the extensions that it requires.
#pragma once

#include <span>
#include <string>

#include "common/result.h"
#include "formats/files/json.h"

namespace clamor {

// An Error names the first required extension that is unknown, that may change geometry, and that
// `ignored` does not name; it says what it may change. The import tells what it cannot hear.
Result<void> check_required_extensions(const Json& document, std::span<const std::string> ignored);

}  // namespace clamor
