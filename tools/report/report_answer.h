// report_answer.h: the top of a report: what the room sounds like in a sentence, and what the
// bake found.
#pragma once

#include "tools/analysis/report_page.h"
#include "tools/report/report_document.h"
#include "tools/report/room_summary.h"

namespace clamor {

void write_answer(const ReportContents& contents, ReportPage& page);

// What rings, warnings, openings and gaps, each with a button that shows its place in the view.
void write_findings(const ReportContents& contents, std::span<const MetMaterial> materials,
                    ReportPage& page);

}  // namespace clamor
