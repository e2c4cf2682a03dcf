// compare_table.h: a comparison as a table that is read in ten seconds, and the measures for
// --help.
#pragma once

#include <iosfwd>
#include <string>
#include <vector>

#include "runtime/measures/null_distribution.h"
#include "runtime/measures/sound_comparison.h"

namespace clamor {

// What the command is for, and all measures with their sources and JNDs.
std::string compare_help();

// "ok", "audible" or "beyond chance"; empty where there is nothing to judge by. `null` may be null.
std::string verdict_on(const Difference& difference, const NullDistribution* null);

// The 95th percentile of chance, in the unit of the difference at a point with that JND.
double chance_95(const NullDistribution& null, const Difference& difference, double jnd);

// A row per measure, and what is audible. `a` and `b` name the sounds.
void print_comparison(const std::string& a, const std::string& b,
                      const std::vector<Difference>& differences, const NullDistribution* null,
                      std::ostream& out);

}  // namespace clamor
