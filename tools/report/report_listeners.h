// report_listeners.h: what each listener of a report hears: decay, echogram and impulse response.
#pragma once

#include "tools/analysis/report_page.h"
#include "tools/report/report_document.h"

namespace clamor {

void write_listeners(const ReportContents& contents, ReportPage& page);

}  // namespace clamor
