// bake_summary.h: what a designer wants to know of a bake when it is done.
#pragma once

#include <iosfwd>
#include <string>

#include "bake/bake.h"
#include "formats/bake_file/bake_contents.h"

namespace clamor {

// The closing lines, after the warnings: decay, energy, what was kept and how to hear it.
void print_bake_summary(const BakeContents& contents, const BakeReport& report,
                        const std::string& output, const std::string& journal, double seconds,
                        std::ostream& err);

}  // namespace clamor
