// clamor_fork_test.cpp: what a child of fork() may do, in which the library has no threads.
#include <array>
#include <string>

#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include "runtime/clamor.h"
#include "tests/library/library_room.h"
#include "tests/sanitized.h"

namespace clamor {
namespace {

using testing::add_listener;
using testing::Context;
using testing::make_context;
using testing::open_level;

// Runs act() in a child, which is killed if it hangs. Returns the child's exit code, or -1.
template <class Act>
int in_child(const Act& act) {
  const pid_t child = ::fork();
  if (child == 0) {
    ::alarm(20);
    ::_exit(act());
  }
  int status = 0;
  return ::waitpid(child, &status, 0) == child && WIFEXITED(status) ? WEXITSTATUS(status) : -1;
}

TEST(ClamorFork, LeavesAChildWithErrorsInsteadOfHanging) {
  if (testing::kSanitized) GTEST_SKIP() << "sanitizers end forked children";
  const Context context = make_context(false);
  const clamor_level level = open_level(context);
  clamor_listener_options in_real_time = testing::offline();
  in_real_time.offline = 0;
  const clamor_listener listener = add_listener(context, level, in_real_time);
  std::array<float, 2 * 960> block{};
  ASSERT_EQ(clamor_render(context.get(), listener, block.data(), 960), CLAMOR_OK);
  const int failed = in_child([&] {
    if (clamor_render(context.get(), listener, block.data(), 960) != CLAMOR_ERROR_ARGUMENT)
      return 1;
    if (clamor_commit(context.get(), 0) != CLAMOR_ERROR_ARGUMENT) return 2;
    if (clamor_destroy_listener(context.get(), listener) != CLAMOR_ERROR_ARGUMENT) return 3;
    clamor_portal_info portal{};
    if (clamor_get_portal_info(context.get(), level, 0, &portal) != CLAMOR_ERROR_ARGUMENT) return 4;
    clamor_context* another = nullptr;
    clamor_error error;
    if (clamor_create(nullptr, &another, &error) != CLAMOR_ERROR_STATE) return 5;
    if (std::string(error.sentence).find("forked") == std::string::npos) return 6;
    clamor_destroy(context.get());
    return 0;
  });
  EXPECT_EQ(failed, 0);
  EXPECT_EQ(clamor_render(context.get(), listener, block.data(), 960), CLAMOR_OK);
}

}  // namespace
}  // namespace clamor
