// level_findings.h: what a bake found in the geometry of its level, with the places, as its file
// keeps it.
//
// The bake writes the sentences once (bake/report/level_report.h); everything that shows them later
// takes them from the file, so that all show the same.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "common/vec.h"

namespace clamor {

// A file holds openings and gaps; the other kinds are those of its warnings (tools/report).
struct LevelFinding {
  enum class Kind : std::uint8_t { kWarning, kFact, kOpening, kGap, kDuplicate };
  Kind kind = Kind::kFact;
  std::string text;  // a sentence or a part of one, without a full stop
  std::optional<Vec3> place_m;
  double size_m = 0;  // width of an opening, length of a gap; 0: unknown
  Vec3 direction{};   // mean of escaping sound

  bool operator==(const LevelFinding&) const = default;
};

struct LevelFindings {
  std::string closedness;    // whether and where sound leaves, in a sentence; "": unknown
  double escaped_share = 0;  // of the emitted power, through openings and seams; 0: none or unknown
  std::uint32_t thin_gaps = 0;
  std::vector<LevelFinding> list;  // openings, then gaps, each the largest first; not all gaps

  bool operator==(const LevelFindings&) const = default;
};

}  // namespace clamor
