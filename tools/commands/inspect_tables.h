// inspect_tables.h: a bake file as tables that one can read in ten seconds.
#pragma once

#include <iosfwd>

#include "tools/commands/bake_overview.h"

namespace clamor {

void print_tables(const BakeFile& file, const BakeOverview& overview, std::ostream& out);

// A line per page. An Error names the one that cannot be read.
Result<void> print_pages(const BakeFile& file, std::ostream& out);

}  // namespace clamor
