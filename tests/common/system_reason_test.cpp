#include "common/system_reason.h"

#include <cerrno>
#include <stdexcept>
#include <system_error>

#include <gmock/gmock.h>

namespace clamor {
namespace {

using ::testing::HasSubstr;

TEST(SystemReason, NamesTheLimitThatWasReached) {
  EXPECT_THAT(system_reason(EMFILE), HasSubstr("ulimit -n"));
  EXPECT_THAT(system_reason(EAGAIN), HasSubstr("ulimit -u"));
  EXPECT_EQ(system_reason(EACCES), "Permission denied");
  const std::system_error no_thread(EAGAIN, std::generic_category());
  EXPECT_THAT(system_reason(no_thread), HasSubstr("no more threads or processes"));
  EXPECT_EQ(system_reason(std::runtime_error("it broke")), "it broke");
}

}  // namespace
}  // namespace clamor
