// report_parameters.h: the room parameters of a report, as charts over frequency and tables.
#pragma once

#include "tools/analysis/report_page.h"
#include "tools/report/report_document.h"

namespace clamor {

void write_parameters(const ReportContents& contents, ReportPage& page);

}  // namespace clamor
