// bake_difference.h: compares two bake files, for clamor diff.
#pragma once

#include <array>
#include <string>
#include <vector>

#include "tools/report/bake_overview.h"

namespace clamor {

struct BakeDifference {
  std::string what, a, b;  // "" if a file has none
};

// Compares the descriptions of the files: provenance, settings, materials, emitters, sizes.
std::vector<BakeDifference> differences_of(const BakeFile& a, const BakeFile& b);

// Power of all of B's sources relative to A's, per band; 0 dB if either has none.
std::array<double, kBandCount> level_difference_db(const Bands& a, const Bands& b);

// Whether emitters, portals, movable parts, materials and air of both are equal.
bool is_same_scene(const BakeFile& a, const BakeFile& b);

// Returns whether both sound the same, to the last bit: scene, sources, signals and surfaces are
// equal.
Result<bool> sound_identical(const BakeFile& a, const BakeFile& b);

}  // namespace clamor
