// report_doors.h: the movable parts and portals of a bake, in its report.
#pragma once

#include <array>

#include "common/vec.h"
#include "formats/bake_file/bake_file.h"
#include "tools/analysis/report_page.h"

namespace clamor {

struct MovablePart;

// A part's box along its own axes, at rest, relative to the level's origin.
struct PartBox {
  Vec3 centre_m{};
  std::array<Vec3, 3> half_m{};  // from the centre to the middles of three sides
};
PartBox box_of(const MovablePart& part);

// A table of them; nothing without any.
void write_doors(const BakeFile& file, ReportPage& page);

}  // namespace clamor
