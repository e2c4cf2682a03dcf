// report_materials.h: the materials of a report: areas, absorption, and where sound is absorbed.
#pragma once

#include "tools/analysis/report_page.h"
#include "tools/report/report_document.h"
#include "tools/report/room_summary.h"

namespace clamor {

void write_materials(std::span<const AbsorbingArea> areas, ReportPage& page);

}  // namespace clamor
