// bake_json.h: a bake file as JSON, for clamor inspect and clamor report; formats/bake_format.md
// documents the keys.
#pragma once

#include "tools/analysis/json_values.h"
#include "tools/report/bake_overview.h"

namespace clamor {

// With `pages`, the JSON lists all pages; the Error names one that cannot be read.
Result<OrderedJson> bake_json(const BakeFile& file, const BakeOverview& overview, bool pages);

}  // namespace clamor
