// report_page_test.cpp: the CSV files of a report.
#include "tools/analysis/report_page.h"

#include <gtest/gtest.h>

#include "tests/tools/run_clamor.h"

namespace clamor {
namespace {

TEST(ReportPage, QuotesTextWithCommasInCsv) {
  const testing::Folder folder;
  ReportPage page("room", "A room", "");
  page.table({"bands", "Bands", {"what", "value"}, {{"C80, dB", 1.5}, {"the \"late\" one", ""}}});
  ASSERT_TRUE(page.write(folder.path()).ok());
  EXPECT_EQ(testing::read(folder / "room_bands.csv"),
            "what,value\n\"C80, dB\",1.5\n\"the \"\"late\"\" one\",\n");
}

}  // namespace
}  // namespace clamor
