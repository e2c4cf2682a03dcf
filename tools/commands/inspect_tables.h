// inspect_tables.h: a bake file as tables for people.
#pragma once

#include <iosfwd>

#include "tools/analysis/json_values.h"
#include "tools/report/bake_overview.h"

namespace clamor {

// `bake` is the file's bake_json(); its pages are printed if it has them.
void print_tables(const BakeFile& file, const BakeOverview& overview, const OrderedJson& bake,
                  std::ostream& out);

}  // namespace clamor
