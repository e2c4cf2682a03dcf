// bake_difference.h: in what two bake files differ, for clamor diff.
#pragma once

#include <array>
#include <string>
#include <vector>

#include "tools/commands/bake_overview.h"

namespace clamor {

struct BakeDifference {
  std::string what, a, b;  // "" where a file has none
};

// In what the files tell of themselves: how they were made, settings, materials, emitters, sizes.
std::vector<BakeDifference> differences_of(const BakeFile& a, const BakeFile& b);

// How much louder all of B's sources are than A's, per band; 0 where neither has any.
std::array<double, kBandCount> level_difference_db(const Bands& a, const Bands& b);

// Whether a listener hears the same of both, to the last bit: sources, signals, walls and air.
Result<bool> sound_identical(const BakeFile& a, const BakeFile& b);

}  // namespace clamor
