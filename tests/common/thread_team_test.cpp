#include "common/thread_team.h"

#include <atomic>
#include <cstdint>
#include <memory>
#include <numeric>
#include <set>
#include <stdexcept>
#include <thread>
#include <tuple>

#include <gtest/gtest.h>

#include "common/random.h"

namespace clamor {
namespace {

TEST(ThreadTeam, RunsEachIterationOnce) {
  for (const int threads : {1, 2, 8})
    with_team(threads, [&] {
      EXPECT_EQ(team_size(), threads);
      for (const std::size_t grain : {1u, 7u, 1000u}) {
        std::vector<std::atomic<int>> runs(5000);
        team_for(100, runs.size(), grain, [&](std::size_t i) { ++runs[i]; });
        for (std::size_t i = 0; i < runs.size(); ++i) ASSERT_EQ(runs[i], i < 100 ? 0 : 1) << i;
      }
    });
  std::atomic<int> outside{0};
  team_for(0, 100, [&](std::size_t) { ++outside; });
  EXPECT_EQ(outside, 100);
}

TEST(ThreadTeam, SharesItsThreadsWithLoopsInLoopsAndHasNoOthers) {
  std::mutex mutex;
  std::set<std::thread::id> threads;
  std::atomic<int> runs{0};
  with_team(4, [&] {
    team_for(0, 20, [&](std::size_t) {
      team_for(0, 50, [&](std::size_t) {
        ++runs;
        const std::lock_guard lock(mutex);
        threads.insert(std::this_thread::get_id());
      });
    });
  });
  EXPECT_EQ(runs, 1000);
  EXPECT_LE(threads.size(), 4u);
}

TEST(ThreadTeam, ThrowsWhatAnIterationThrowsAndEndsItsLoop) {
  for (const int threads : {1, 4})
    with_team(threads, [&] {
      std::atomic<int> runs{0};
      EXPECT_THROW(team_for(0, 1'000'000,
                            [&](std::size_t i) {
                              ++runs;
                              if (i == 10) throw std::runtime_error("ten");
                            }),
                   std::runtime_error);
      EXPECT_LT(runs, 1'000'000);
      std::atomic<int> after{0};
      team_for(0, 10, [&](std::size_t) { ++after; });
      EXPECT_EQ(after, 10) << "the team works on";
    });
}

TEST(ThreadTeam, SortsAsTheStandardLibraryDoes) {
  for (const std::uint32_t distinct : {1u, 3u, 1000u, ~0u})
    for (const std::size_t size : {0u, 1u, 9999u, 10'000u, 300'000u}) {
      std::vector<std::pair<std::uint32_t, std::uint32_t>> values(size);
      for (std::uint32_t i = 0; i < size; ++i)
        values[i] = {philox(7, {i, distinct, 0, 0})[0] % distinct, i};
      auto expected = values;
      std::sort(expected.begin(), expected.end());
      for (const int threads : {1, 3, 8}) {
        auto sorted = values;
        with_team(threads, [&] { team_sort(sorted.begin(), sorted.end(), std::less<>()); });
        ASSERT_EQ(sorted, expected) << size << " of " << distinct << " on " << threads;
      }
    }
}

TEST(ThreadTeam, TakesItemsThroughAPipelineInOrder) {
  for (const int threads : {1, 2, 8}) {
    constexpr int kItems = 300;
    constexpr std::size_t kAtOnce = 5;
    int begun = 0;
    std::atomic<std::size_t> under_way{0}, most{0};
    std::vector<int> worked(kItems), ended;
    std::vector<std::unique_ptr<int>> items;
    with_team(threads, [&] {
      team_pipeline<int>(
          kAtOnce,
          [&]() -> int* {
            if (begun == kItems) return nullptr;
            const std::size_t now = ++under_way;
            most = std::max<std::size_t>(most, now);
            return items.emplace_back(std::make_unique<int>(begun++)).get();
          },
          [&](int* item) {
            if (*item % 7 == 0) std::this_thread::yield();
            worked[static_cast<std::size_t>(*item)] = 1;
          },
          [&](int* item) {
            EXPECT_EQ(worked[static_cast<std::size_t>(*item)], 1);
            ended.push_back(*item);
            --under_way;
          });
    });
    std::vector<int> expected(kItems);
    std::iota(expected.begin(), expected.end(), 0);
    EXPECT_EQ(ended, expected) << threads;
    EXPECT_LE(most, kAtOnce);
  }
}

TEST(ThreadTeam, EndsAPipelineWhoseStageThrows) {
  for (const int stage : {0, 1, 2})
    with_team(3, [&] {
      std::atomic<int> begun{0};
      int item = 0;
      const auto throws = [&](int here) {
        if (here == stage && begun > 20) throw std::runtime_error("a stage");
      };
      EXPECT_THROW(team_pipeline<int>(
                       4,
                       [&] {
                         ++begun;
                         throws(0);
                         return &item;
                       },
                       [&](int*) {
                         if (stage == 1) throw std::runtime_error("a stage");
                       },
                       [&](int*) { throws(2); }),
                   std::runtime_error)
          << stage;
    });
}

}  // namespace
}  // namespace clamor
