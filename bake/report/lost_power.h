// lost_power.h: how power left a level: through openings, or through walls, which transmit it.
//
// Photons tell how much left, but not which way: they pass walls as well as openings. The openings
// are known from lines that no wall lets through (level_openings.h), so the rest passed walls.
#pragma once

#include <span>
#include <string>

#include "common/material.h"
#include "formats/bake_file/bake_metadata.h"

namespace clamor {

// Shares of the emitted power.
struct LostPower {
  double through_openings = 0, through_walls = 0;
  double all() const { return through_openings + through_walls; }
};

// In files of older programs that do not know their openings, all is counted as through these.
LostPower lost_power(const BakeStatistics& statistics, std::span<const Material> materials);

// "through walls", "through openings" or the shares of both; "" if nothing was lost.
std::string ways_of(const LostPower& lost);

// Example: "3.9 % of the power, through walls".
std::string in_words(const LostPower& lost);

}  // namespace clamor
