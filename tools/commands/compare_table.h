// compare_table.h: a comparison as a table, and the list of measures for --help.
#pragma once

#include <iosfwd>
#include <string>
#include <vector>

#include "tools/analysis/null_distribution.h"
#include "tools/analysis/sound_comparison.h"

namespace clamor {

// Purpose of the command, and all measures with their sources and JNDs.
std::string compare_help();

// Returns "ok", "audible" or "beyond chance"; empty if there is no criterion. `null` may be null.
std::string verdict_on(const Difference& difference, const NullDistribution* null);

// 95th percentile of chance, in the unit of the difference at a point with that JND.
double chance_95(const NullDistribution& null, const Difference& difference, double jnd);

// Prints a row per measure, then the audible ones. `a` and `b` name the sounds.
void print_comparison(const std::string& a, const std::string& b,
                      const std::vector<Difference>& differences, const NullDistribution* null,
                      std::ostream& out);

}  // namespace clamor
