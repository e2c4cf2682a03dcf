// inspect_json.h: a bake file as JSON; formats/bake_format.md documents the keys.
#pragma once

#include <string>

#include "tools/report/bake_overview.h"

namespace clamor {

// With `pages`, the JSON lists all pages; the Error names one that cannot be read.
Result<std::string> as_json(const BakeFile& file, const BakeOverview& overview, bool pages);

}  // namespace clamor
