// level_findings.h: what a bake found in its level, with the places that the report shows.
//
// Warnings are those that the bake kept in the file; a place in their text, as "(1.0, 2.0, 3.0)",
// is where the report leads to. Openings and thin gaps are found again in the geometry of the file,
// with the functions of the bake.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "bake/report/level_report.h"
#include "common/vec.h"
#include "tools/report/room.h"

namespace clamor {

struct LevelFinding {
  enum class Kind { kWarning, kFact, kOpening, kGap, kDuplicate };
  Kind kind = Kind::kFact;
  std::string text;
  std::optional<Vec3> place_m;
  double size_m = 0;  // width of an opening, length of a gap; 0: unknown
  Vec3 direction{};   // of escaping sound
};

struct LevelFindings {
  std::vector<LevelFinding> findings;  // warnings first
  LevelReport level;                   // of the geometry in the file
};

LevelFindings find_in_level(const Room& room);

// The first place in a sentence, "(1.0, -2.0, 3.0)" or "at 1,-2,3".
std::optional<Vec3> place_in(const std::string& sentence);

}  // namespace clamor
