// memory_limits.h: builds something in child processes with less and more memory.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include <gtest/gtest.h>

#include "common/platform/child_process.h"
#include "tests/sanitized.h"

namespace clamor::testing {

// Expects build() to throw, rather than crash, when memory is short, and to succeed when there is
// enough. Limits grow from 1 MB to 1 GB beyond what this process has.
template <class Build>
void expect_throws_without_memory(Build build) {
  if (kSanitized) GTEST_SKIP() << "sanitizers reserve address space";
  bool has_thrown = false, has_built = false;
  for (std::uint64_t megabytes = 1; megabytes <= 1024; megabytes *= 2) {
    ChildLimits limits;
    limits.memory_bytes = megabytes << 20;
    const auto built = in_child_process(limits, [&build] {
      build();
      return std::vector<std::byte>(1);
    });
    has_built = built.ok();
    if (built.ok()) continue;
    has_thrown = true;
    EXPECT_EQ(built.error().message, "needs more memory than allowed") << megabytes << " MB";
  }
  EXPECT_TRUE(has_thrown);
  EXPECT_TRUE(has_built);
}

}  // namespace clamor::testing
