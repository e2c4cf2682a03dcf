// inspect_json.h: a bake file as JSON; formats/bake_format.md says what each key holds.
#pragma once

#include <string>

#include "tools/commands/bake_overview.h"

namespace clamor {

// `pages`: with a list of all pages too, of which an Error names the one that cannot be read.
Result<std::string> as_json(const BakeFile& file, const BakeOverview& overview, bool pages);

}  // namespace clamor
