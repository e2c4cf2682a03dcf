// child_process_test.cpp: failures of the child are reported and do not affect this process.
#include "common/platform/child_process.h"

#include <csignal>
#include <cstdlib>
#include <functional>
#include <string>
#include <thread>
#include <vector>

#include <gtest/gtest.h>
#include <unistd.h>

#include "tests/sanitized.h"

namespace clamor {
namespace {

using Bytes = std::vector<std::byte>;

std::string what_becomes_of(const std::function<Bytes()>& work, const ChildLimits& limits = {}) {
  const auto result = in_child_process(limits, work);
  return result.ok() ? "" : result.error().message;
}

TEST(ChildProcess, ReturnsResultsOfAnySizeOnAnyThread) {
  // AddressSanitizer's allocator, unlike glibc's, does not release its locks in a forked child. One
  // that another thread held during fork() stays locked there, and the child waits for it forever.
  const std::size_t thread_count = testing::kSanitized ? 1 : 4;
  std::vector<std::thread> threads;
  for (std::size_t t = 0; t < thread_count; ++t)
    threads.emplace_back([t] {
      for (const std::size_t count : {std::size_t{0}, std::size_t{1}, 5'000'000 + t}) {
        const auto found =
            in_child_process({}, [=] { return Bytes(count, static_cast<std::byte>(t)); });
        ASSERT_TRUE(found.ok()) << found.error().message;
        EXPECT_EQ(*found, Bytes(count, static_cast<std::byte>(t)));
      }
    });
  for (std::thread& thread : threads) thread.join();
}

TEST(ChildProcess, MayCrashOrEnd) {
  int mine = 1;
  EXPECT_EQ(what_becomes_of([&]() -> Bytes {
              mine = 2;
              ::raise(SIGSEGV);
              return {};
            }),
            "crashes the library that reads it");
  EXPECT_EQ(mine, 1);  // the child has its own memory
  EXPECT_EQ(what_becomes_of([]() -> Bytes { std::abort(); }), "crashes the library that reads it");
  EXPECT_EQ(what_becomes_of([]() -> Bytes { ::_exit(0); }), "crashes the library that reads it");
}

TEST(ChildProcess, MayHang) {
  ChildLimits limits;
  limits.cpu_s = 1;
  EXPECT_EQ(what_becomes_of(
                []() -> Bytes {
                  volatile bool goes_on = true;
                  while (goes_on) {
                  }
                  return {};
                },
                limits),
            "takes more than 1 s to read");
}

TEST(ChildProcess, MayBlockForever) {
  ChildLimits limits;
  limits.wall_s = 1;
  EXPECT_EQ(what_becomes_of(
                []() -> Bytes {
                  for (;;) ::pause();
                },
                limits),
            "takes more than 1 s to read");
}

TEST(ChildProcess, IsStoppedByInterruptsThatTheParentHandles) {
  const auto before = std::signal(SIGINT, [](int) {});
  EXPECT_EQ(what_becomes_of([]() -> Bytes {
              ::raise(SIGINT);
              return {};
            }),
            "was not read completely because the program was stopped");
  std::signal(SIGINT, before);
}

TEST(ChildProcess, MayRequestAnyMemoryAndReturnAnySize) {
  if (testing::kSanitized) GTEST_SKIP() << "a sanitizer ends the child as for a crash";
  ChildLimits limits;
  limits.memory_bytes = 100'000'000;
  EXPECT_EQ(what_becomes_of([]() -> Bytes { return Bytes(2'000'000'000); }, limits),
            "needs more memory than allowed");
  limits.max_result_bytes = 1000;
  EXPECT_EQ(what_becomes_of([]() -> Bytes { return Bytes(1001); }, limits),
            "returns more data than allowed");
}

}  // namespace
}  // namespace clamor
