// report_file.h: the file that a report is about: power by depth, bytes, and how it was made.
#pragma once

#include "tools/analysis/report_page.h"
#include "tools/report/report_document.h"

namespace clamor {

void write_file(const ReportContents& contents, ReportPage& page);

}  // namespace clamor
