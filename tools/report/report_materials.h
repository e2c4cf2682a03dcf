// report_materials.h: the materials of a report: their absorption, and where sound is absorbed.
#pragma once

#include "tools/analysis/report_page.h"
#include "tools/report/report_document.h"
#include "tools/report/room_summary.h"

namespace clamor {

void write_materials(const BakeFile& file, std::span<const MetMaterial> materials,
                     ReportPage& page);

}  // namespace clamor
