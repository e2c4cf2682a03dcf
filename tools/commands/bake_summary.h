// bake_summary.h: the closing lines of a bake.
#pragma once

#include <iosfwd>
#include <string>

#include "bake/bake.h"
#include "formats/bake_file/bake_contents.h"

namespace clamor {

// Prints energy, decay, sizes and the command to listen.
void print_bake_summary(const BakeContents& contents, const BakeReport& report,
                        const std::string& output, const std::string& journal, bool removed_journal,
                        double seconds, std::ostream& err);

}  // namespace clamor
