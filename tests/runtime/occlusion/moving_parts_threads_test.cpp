// moving_parts_threads_test.cpp: commits of one thread, read by another.
#include <atomic>
#include <thread>
#include <vector>

#include <gtest/gtest.h>

#include "runtime/occlusion/moving_parts.h"

namespace clamor {
namespace {

// Each commit moves all parts to the same place.
TEST(MovingPartsThreads, SeeWholeCommitsInTheirOrder) {
  constexpr int kCommits = 20'000, kParts = 8;
  MovingParts parts;
  std::vector<PartHandle> handles;
  for (int p = 0; p < kParts; ++p) handles.push_back(*parts.add(nullptr, {}));
  parts.commit();
  std::atomic<bool> has_ended{false};
  std::thread caller([&] {
    for (int commit = 1; commit <= kCommits; ++commit) {
      for (const PartHandle handle : handles)
        EXPECT_TRUE(parts.move(handle, {{1.0 * commit, 0, 0}}).ok());
      parts.commit();
    }
    has_ended = true;
  });
  double last_m = 0;
  for (bool ends = false; !ends;) {
    ends = has_ended;
    const MovingParts::Snapshot& snapshot = parts.latest();
    ASSERT_EQ(snapshot.parts.size(), static_cast<std::size_t>(kParts));
    const double now_m = snapshot.parts[0].pose.position_m.x;
    EXPECT_GE(now_m, last_m);
    for (const MovingParts::Part& part : snapshot.parts) ASSERT_EQ(part.pose.position_m.x, now_m);
    last_m = now_m;
  }
  caller.join();
  EXPECT_EQ(parts.latest().parts[0].pose.position_m.x, kCommits);
  EXPECT_FALSE(parts.has_pending_commit());
}

}  // namespace
}  // namespace clamor
