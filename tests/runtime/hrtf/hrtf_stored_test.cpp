// hrtf_stored_test.cpp: the head that the program embeds, and heads as bytes.
#include <cstddef>
#include <memory>
#include <span>
#include <vector>

#include <gtest/gtest.h>

#include "runtime/hrtf/hrtf.h"
#include "tests/runtime/hrtf_mixing.h"

namespace clamor {
namespace {

// Compares with a fresh fit. If the fit has changed, run make_head.
TEST(DefaultHead, IsTheFitOfItsMeasurement_NoAsan) {
  const auto fitted = Hrtf::read(testing::kKemar), embedded = Hrtf::read("");
  ASSERT_TRUE(fitted.ok() && embedded.ok());
  ASSERT_GT((*embedded)->directions(), 700u);
  const std::vector<std::byte> now = (*fitted)->stored(), then = (*embedded)->stored();
  ASSERT_EQ(now.size(), then.size());
  // The last bits are the C library's and the compiler's.
  for (std::size_t d = 0; d < (*fitted)->directions(); ++d) {
    const Vec3f& from = testing::kemar().directions[d];
    const auto a = (*fitted)->gains(from), b = (*embedded)->gains(from);
    for (std::size_t e = 0; e < kEars; ++e)
      for (std::size_t band = 0; band < kHrtfBands; ++band)
        ASSERT_NEAR(a[e][band], b[e][band], 1e-4) << d;
    ASSERT_NEAR((*fitted)->delay_frames(from, 0), (*embedded)->delay_frames(from, 0), 1e-3) << d;
  }
}

TEST(DefaultHead, IsReadOnlyIfItIsWhole) {
  std::vector<std::byte> bytes = testing::kemar_head().stored();
  const auto again = Hrtf::from_stored(bytes);
  ASSERT_NE(again, nullptr);
  EXPECT_EQ(again->stored(), bytes);
  EXPECT_EQ(Hrtf::from_stored({}), nullptr);
  EXPECT_EQ(Hrtf::from_stored(std::span(bytes).first(bytes.size() - 1)), nullptr);
  bytes.push_back({});
  EXPECT_EQ(Hrtf::from_stored(bytes), nullptr);
  bytes.pop_back();
  bytes[12] = bytes[13] = bytes[14] = bytes[15] = std::byte{0xff};  // the number of directions
  EXPECT_EQ(Hrtf::from_stored(bytes), nullptr);
  bytes[0] = {};
  EXPECT_EQ(Hrtf::from_stored(bytes), nullptr);
}

}  // namespace
}  // namespace clamor
