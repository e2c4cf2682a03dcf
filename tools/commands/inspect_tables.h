// inspect_tables.h: a bake file as tables for people.
#pragma once

#include <iosfwd>

#include "tools/report/bake_overview.h"

namespace clamor {

void print_tables(const BakeFile& file, const BakeOverview& overview, std::ostream& out);

// Prints a line per page. The Error names a page that cannot be read.
Result<void> print_pages(const BakeFile& file, std::ostream& out);

}  // namespace clamor
