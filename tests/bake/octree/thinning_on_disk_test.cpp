#include "bake/octree/thinning_on_disk.h"

#include <cstring>

#include <gtest/gtest.h>
#include <unistd.h>

#include "bake/octree/source_thinning.h"
#include "tests/source_lists.h"

namespace clamor {
namespace {

TEST(ThinningOnDisk, KeepsTheSourcesThatThinningInMemoryKeeps) {
  const std::string beside = ::testing::TempDir() + "/clamor_thin_" + std::to_string(::getpid());
  for (const int kind : {0, 1, 2}) {
    // With few places and keys, many deposits are equal, and the first of them are kept.
    const auto deposits = kind == 0 ? testing::wall_sources(50'000)
                          : kind == 1
                              ? testing::degenerate_sources(50'000, 1, {.keys = 3, .places = 2})
                              : testing::degenerate_sources(50'000, 1, {.keys = 1, .places = 1});
    for (const std::uint64_t max : {1u, 999u, 20'000u, 49'999u, 50'000u, 60'000u}) {
      SourceThinning in_memory(max);
      ThinningOnDisk on_disk(max, beside);
      for (std::size_t first = 0; first < deposits.size(); first += 700) {
        const auto some =
            std::span(deposits).subspan(first, std::min<std::size_t>(700, deposits.size() - first));
        in_memory.add(some, first);
        ASSERT_TRUE(on_disk.add(some).ok());
      }
      ASSERT_TRUE(on_disk.finish().ok());
      const auto expected = in_memory.take();
      std::vector<Source> kept;
      for (int reading = 0; reading < 2; ++reading) {
        kept.clear();
        const auto read = on_disk.for_each([&](std::span<Source> sources) -> Result<void> {
          kept.insert(kept.end(), sources.begin(), sources.end());
          return {};
        });
        ASSERT_TRUE(read.ok());
      }
      EXPECT_EQ(on_disk.kept(), expected.size());
      ASSERT_EQ(kept.size(), expected.size()) << kind << ", " << max;
      for (std::size_t i = 0; i < kept.size(); ++i) {
        ASSERT_EQ(kept[i].position_m, expected[i].position_m) << kind << ", " << max << ", " << i;
        ASSERT_EQ(kept[i].power, expected[i].power) << kind << ", " << max << ", " << i;
        ASSERT_EQ(kept[i].u, expected[i].u) << kind << ", " << max << ", " << i;
      }
    }
  }
}

}  // namespace
}  // namespace clamor
