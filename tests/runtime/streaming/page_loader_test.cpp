#include "runtime/streaming/page_loader.h"

#include <atomic>
#include <cmath>
#include <mutex>
#include <thread>

#include <gtest/gtest.h>

namespace clamor {
namespace {

constexpr std::size_t kPages = 40;

// Pages of 100 sources each, the first at x = page; page 13 cannot be read.
class PageLoaderTest : public ::testing::Test {
 protected:
  PageLoaderTest()
      : radiation_(emitters_, materials_, Air{}), page_bytes_((*fetch(at(0)))->bytes()) {}

  static PageEntry at(std::uint64_t page) {
    PageEntry entry;
    entry.page.offset = page;
    entry.source_count = 100;
    return entry;
  }

  PageLoader::Content fetch(const PageEntry& entry) {
    const auto page = static_cast<std::uint32_t>(entry.page.offset);
    {
      const std::lock_guard lock(mutex_);
      fetched_.push_back(page);
    }
    if (page == 13) return Error("page 13 is damaged");
    std::vector<Source> sources(100);
    for (Source& source : sources) source.position_m.x = static_cast<float>(page);
    return std::make_unique<const ResidentPage>(
        entry, SourcePage(radiation_, weights_, std::move(sources)), PageLinks{},
        std::span<const PageEntry>());
  }
  PageLoader::Fetch fetcher() {
    return [this](const PageEntry& entry) { return fetch(entry); };
  }

  const std::vector<Emitter> emitters_{1};
  const std::vector<Material> materials_{1};
  const RadiationModel radiation_;
  const std::vector<Bands> weights_{same_in_all_bands(1)};
  std::mutex mutex_;
  std::vector<std::uint32_t> fetched_;
  const std::uint64_t page_bytes_;
};

TEST_F(PageLoaderTest, LoadsRequestedPagesAndNothingElse) {
  PageLoader loader(fetcher(), PageBudget{1'000'000});
  loader.begin_sample();
  EXPECT_EQ(loader.use(at(3), 1), nullptr);
  EXPECT_FALSE(loader.wait());
  loader.request({{1, at(3)}, {2, at(4)}});
  while (loader.wait()) loader.begin_sample();
  ASSERT_NE(loader.use(at(3), 1), nullptr);
  EXPECT_EQ(loader.use(at(3), 1)->sources[0].position_m.x, 3);
  EXPECT_NE(loader.use(at(4), 1), nullptr);
  EXPECT_EQ(loader.use(at(5), 1), nullptr);
  EXPECT_EQ(loader.statistics().asked, 2u);
  EXPECT_EQ(loader.statistics().loaded, 2u);
}

// A page that arrives a second time must not replace the first, which a query may hold.
TEST_F(PageLoaderTest, KeepsAPageThatWasLoadedAtOnceWhileAThreadReadIt) {
  std::atomic<bool> reads = false, may_go_on = false;
  const auto self = std::this_thread::get_id();
  PageLoader loader(
      [&](const PageEntry& entry) {
        if (std::this_thread::get_id() != self) {
          reads = true;
          while (!may_go_on) std::this_thread::yield();
        }
        return fetch(entry);
      },
      PageBudget{1'000'000});
  loader.begin_sample();
  loader.use(at(3), 1);
  loader.request({{1, at(3)}});
  while (!reads) std::this_thread::yield();
  ASSERT_TRUE(loader.load_now(at(3)));
  const ResidentPage* const page = loader.find(at(3));
  may_go_on = true;
  while (loader.wait()) loader.begin_sample();
  loader.begin_sample();
  EXPECT_EQ(loader.find(at(3)), page);
  EXPECT_EQ(loader.statistics().bytes, page_bytes_);
}

// A forged file may name one page twice, with different sources.
TEST_F(PageLoaderTest, RejectsAnEntryThatDisagreesWithThePage) {
  PageLoader loader(fetcher(), PageBudget{1'000'000});
  ASSERT_TRUE(loader.load_now(at(3)));
  PageEntry other = at(3);
  other.source_count = 0;
  EXPECT_FALSE(loader.load_now(other));
  EXPECT_TRUE(loader.has_failed(other)) << "it must not be requested again";
  EXPECT_EQ(loader.find(other), nullptr);
  EXPECT_EQ(loader.use(other, 1), nullptr);
  EXPECT_EQ(loader.find_entry(other), nullptr);
  EXPECT_FALSE(loader.has_failed(at(3)));
  EXPECT_NE(loader.use(at(3), 1), nullptr);
}

TEST_F(PageLoaderTest, LoadsTheMostUrgentPagesFirst) {
  fetched_.clear();
  std::atomic<bool> open = false;
  PageLoader loader(
      [&](const PageEntry& page) {
        while (!open) std::this_thread::yield();
        return fetch(page);
      },
      PageBudget{1'000'000});
  loader.request({{1, at(0)}});
  loader.request({{5, at(1)}, {9, at(2)}, {1, at(3)}, {7, at(4)}});
  open = true;
  while (loader.wait()) loader.begin_sample();
  // Page 0 may have been loading when the others were requested; otherwise it is dropped from the
  // queue.
  std::erase(fetched_, 0u);
  EXPECT_EQ(fetched_, (std::vector<std::uint32_t>{2, 4, 1, 3}));
}

TEST_F(PageLoaderTest, EvictsTheLeastRecentlyUsedPagesBeyondItsBudget) {
  PageLoader loader(fetcher(), PageBudget{10 * page_bytes_});
  const auto load = [&](std::uint32_t page) {
    loader.request({{1, at(page)}});
    while (loader.wait()) loader.begin_sample();
    loader.use(at(page), 1);
    loader.use(at(0), 9);  // always in use
  };
  for (std::uint32_t page = 0; page < 13; ++page) {
    load(page);
    loader.begin_sample();
    loader.use(at(0), 9);
    EXPECT_LE(loader.statistics().bytes, 11 * page_bytes_);
  }
  loader.begin_sample();
  loader.begin_sample();
  EXPECT_LE(loader.statistics().bytes, 10 * page_bytes_);
  EXPECT_TRUE(loader.is_here(at(0)));
  EXPECT_TRUE(loader.is_here(at(12)));
  EXPECT_FALSE(loader.is_here(at(1)));
  EXPECT_EQ(loader.statistics().dropped + loader.statistics().resident, 13u);
}

TEST_F(PageLoaderTest, LoadsNoMoreThanFitsBesideThePagesInUse) {
  PageLoader loader(fetcher(), PageBudget{4 * page_bytes_});
  ASSERT_TRUE(loader.load_now(at(0)));
  loader.begin_sample();
  loader.use(at(0), 9);
  std::vector<PageRequest> wanted;
  for (std::uint32_t page = 1; page < 13; ++page) wanted.push_back({1.0 / page, at(page)});
  loader.request(wanted);
  while (loader.wait()) loader.begin_sample();
  EXPECT_EQ(loader.statistics().loaded, 4u);  // page 0 and the three most urgent
  EXPECT_TRUE(loader.is_here(at(1)) && loader.is_here(at(2)) && loader.is_here(at(3)));
}

TEST_F(PageLoaderTest, EvictsPagesOfHalfTheUrgencyWhenTheBudgetIsFull) {
  PageLoader loader(fetcher(), PageBudget{4 * page_bytes_});
  ASSERT_TRUE(loader.load_now(at(0)));
  // The listener passes pages 1 to 12, whose urgency falls with distance, and uses the loaded ones.
  for (std::uint32_t place = 1; place < 13; ++place)
    for (int sample = 0; sample < 5; ++sample) {
      loader.begin_sample();
      EXPECT_LE(loader.statistics().bytes, 4 * page_bytes_);
      std::vector<PageRequest> wanted;
      for (std::uint32_t page = 0; page < 13; ++page) {
        const double urgency = std::pow(0.6, page > place ? page - place : place - page);
        if (loader.is_here(at(page)))
          loader.use(at(page), urgency);
        else
          wanted.push_back({urgency, at(page)});
      }
      loader.request(wanted);
      while (loader.wait()) loader.begin_sample();
      if (sample < 4) continue;
      EXPECT_TRUE(loader.is_here(at(0))) << "it stays";
      EXPECT_TRUE(loader.is_here(at(place))) << place;
    }
  // Nothing changes for a listener who stands still, because no missing page is twice as urgent.
  const std::uint64_t loaded = loader.statistics().loaded;
  for (int sample = 0; sample < 5; ++sample) {
    loader.begin_sample();
    std::vector<PageRequest> wanted;
    for (std::uint32_t page = 0; page < 13; ++page)
      if (loader.is_here(at(page)))
        loader.use(at(page), 1);
      else
        wanted.push_back({1.9, at(page)});
    loader.request(wanted);
    while (loader.wait()) loader.begin_sample();
  }
  EXPECT_EQ(loader.statistics().loaded, loaded);
}

TEST_F(PageLoaderTest, ExceedsALooseBudgetForPagesThatAreNeeded) {
  PageLoader loader(fetcher(), PageBudget{4 * page_bytes_, false});
  ASSERT_TRUE(loader.load_now(at(0)));
  loader.begin_sample();
  loader.use(at(0), 9);
  std::vector<PageRequest> wanted;
  for (std::uint32_t page = 1; page < 13; ++page)
    wanted.push_back({1.0 / page, at(page), page < 9});
  loader.request(wanted);
  while (loader.wait()) {
    loader.begin_sample();
    for (std::uint32_t page = 0; page < 9; ++page) loader.use(at(page), 1);
  }
  for (std::uint32_t page = 0; page < 9; ++page) EXPECT_TRUE(loader.is_here(at(page))) << page;
  EXPECT_EQ(loader.statistics().loaded, 9u);
}

TEST_F(PageLoaderTest, ReportsPagesThatCannotBeRead) {
  PageLoader loader(fetcher(), PageBudget{1'000'000});
  loader.request({{1, at(13)}, {2, at(14)}});
  while (loader.wait()) loader.begin_sample();
  EXPECT_TRUE(loader.has_failed(at(13)));
  EXPECT_EQ(loader.use(at(13), 1), nullptr);
  EXPECT_NE(loader.use(at(14), 1), nullptr);
  EXPECT_EQ(loader.statistics().failed, 1u);
  EXPECT_EQ(loader.statistics().failure, "page 13 is damaged");
  EXPECT_FALSE(loader.load_now(at(13)));
}

TEST_F(PageLoaderTest, EndsWhileManyPagesAreLoading) {
  for (int i = 0; i < 50; ++i) {
    PageLoader loader(fetcher(), PageBudget{1'000'000}, 2);
    std::vector<PageRequest> wanted;
    for (std::uint32_t page = 0; page < kPages; ++page) wanted.push_back({1, at(page)});
    loader.request(wanted);
    if (i % 2 == 0) loader.wait();
    loader.begin_sample();
    loader.request({});
  }
}

}  // namespace
}  // namespace clamor
