#include "common/object_pool.h"

#include <atomic>
#include <set>

#include <gtest/gtest.h>

#include "common/parallel_for.h"

namespace clamor {
namespace {

TEST(ObjectPool, LendsAnObjectAgainOnceItIsGivenBack) {
  ObjectPool<int> pool;
  int* first = nullptr;
  {
    const auto one = pool.borrow();
    const auto other = pool.borrow();
    EXPECT_NE(one.get(), other.get());
    *one = 7;
    first = one.get();
  }
  const auto again = pool.borrow();
  EXPECT_EQ(again.get(), first);
  EXPECT_EQ(*again, 7);
}

TEST(ObjectPool, NeverLendsAnObjectToTwoThreadsAtOnce) {
  struct Guarded {
    std::atomic<int> users = 0;
    std::set<std::size_t> seen = {};
  };
  ObjectPool<Guarded> pool;
  std::atomic<int> shared = 0;
  parallel_for(10000, 1, 4, [&](std::size_t first, std::size_t) {
    const auto lent = pool.borrow();
    shared += lent->users++;
    lent->seen.insert(first);
    --lent->users;
  });
  EXPECT_EQ(shared, 0);
}

}  // namespace
}  // namespace clamor
