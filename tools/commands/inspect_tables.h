// inspect_tables.h: a bake file as tables for people.
#pragma once

#include <iosfwd>

#include <nlohmann/json_fwd.hpp>

#include "tools/report/bake_overview.h"

namespace clamor {

// `bake` is the file's bake_json(); its pages are printed if it has them.
void print_tables(const BakeFile& file, const BakeOverview& overview,
                  const nlohmann::ordered_json& bake, std::ostream& out);

}  // namespace clamor
