// level_findings.h: all that a bake found in its level, in one list, with the places that the
// report and the window lead to.
//
// Warnings are those that the bake kept in the file; a place in their text, as "(1.0, 2.0, 3.0)",
// is where they lead to. Openings and thin gaps stand in the file with their places.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "common/vec.h"
#include "formats/bake_file/bake_metadata.h"
#include "formats/bake_file/level_findings.h"

namespace clamor {

// Warnings first, then openings, or that there are none, then gaps.
std::vector<LevelFinding> findings_of(const BakeStatistics& statistics);

// "Warning", "Thin gap" and so on.
const char* title_of(LevelFinding::Kind kind);
// Whether the bake warns of it.
bool is_warning(const LevelFinding& finding);

// The first place in a sentence, "(1.0, -2.0, 3.0)" or "at 1,-2,3".
std::optional<Vec3> place_in(const std::string& sentence);

// "clamor view hall.clamor --at 1.0,-2.0,3.0", for a shell.
std::string view_command(const std::string& path, const Vec3& place_m);

}  // namespace clamor
