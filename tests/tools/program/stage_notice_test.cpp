#include "tools/program/stage_notice.h"

#include <sstream>

#include <gtest/gtest.h>

namespace clamor {
namespace {

TEST(StageNotice, NamesAStageOnceItHasLastedForLong) {
  std::ostringstream err;
  StageNotice notice(err, std::chrono::milliseconds(0));
  notice.begin("searching");
  for (bool is_named = false; !is_named; std::this_thread::yield()) {
    const auto held = notice.hold();
    is_named = !err.str().empty();
  }
  notice.end();
  const auto held = notice.hold();
  EXPECT_EQ(err.str(), "  stage    searching\n");
}

TEST(StageNotice, SaysNothingOfShortStages) {
  std::ostringstream err;
  {
    StageNotice notice(err, std::chrono::hours(1));
    notice.begin("reading");
    notice.begin("searching");
  }
  EXPECT_EQ(err.str(), "");
}

}  // namespace
}  // namespace clamor
