// places_file.h: places to measure, from a table: a line for each, X,Y,Z in metres or X,Y,Z,NAME.
//
// Empty lines, lines that begin with "#", and a header "x,y,z" or "x,y,z,name" are left out, so
// that numpy.savetxt(..., delimiter=",") and spreadsheets write it.
#pragma once

#include <string>
#include <vector>

#include "common/result.h"
#include "common/vec.h"

namespace clamor {

struct NamedPlace {
  Vec3 at_m{};
  std::string name;  // of a file without its ending; no other place has it
};

// The Error names the line.
Result<std::vector<NamedPlace>> read_places(const std::string& path);

// Names places that have no name by their numbers, from 1 on, with as many digits as the last has:
// "001". An Error if a name is given twice.
Result<void> complete_names(std::vector<NamedPlace>& places);

}  // namespace clamor
