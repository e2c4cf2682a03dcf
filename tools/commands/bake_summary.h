// bake_summary.h: the closing lines of a bake.
#pragma once

#include <iosfwd>
#include <string>

#include "bake/bake.h"
#include "bake/absorption_fit.h"
#include "formats/bake_file/bake_contents.h"

namespace clamor {

// Prints energy, decay, sizes and the command to listen.
void print_bake_summary(const BakeContents& contents, const BakeReport& report,
                        const std::string& output, const std::string& journal, bool removed_journal,
                        double seconds, std::ostream& err);

// Prints the times and absorptions before and after, and what each absorption changes.
void print_fit(const AbsorptionFit& fit, const MeasuredDecay& measured, const std::string& output,
               std::ostream& err);

}  // namespace clamor
