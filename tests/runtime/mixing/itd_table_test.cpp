#include "runtime/mixing/itd_table.h"

#include <algorithm>
#include <cmath>

#include <gtest/gtest.h>

#include "tests/runtime/hrtf_mixing.h"

namespace clamor {
namespace {

// The table is as accurate as the triangles that it was made from, except in a ring at a third of
// the sphere's height: below it KEMAR was not measured, triangles are slivers, and delays bend
// within less than a cell.
TEST(ItdTable, EqualsTheHrtfWithinAMicrosecondNearlyEverywhere) {
  const Hrtf& head = testing::kemar_head();
  const ItdTable itd_table(head);
  constexpr std::uint32_t kDirections = 20'000;
  constexpr double kMicrosecond_frames = 1e-6 * kSampleRate_hz;
  constexpr double kMeasuredFrom = -0.64;
  double worst_frames = 0, worst_below_frames = 0;
  std::size_t beyond = 0;
  for (std::uint32_t i = 0; i < kDirections; ++i) {
    const double z = 2 * (i + 0.5) / kDirections - 1, turn = 2.399963 * i;
    const double flat = std::sqrt(1 - z * z);
    const Vec3f from(Vec3(flat * std::cos(turn), flat * std::sin(turn), z));
    const double expected = head.delay_frames(from, 1) - head.delay_frames(from, 0);
    const double error = std::abs(static_cast<double>(itd_table(from)) - expected);
    if (z > kMeasuredFrom) worst_frames = std::max(worst_frames, error);
    worst_below_frames = std::max(worst_below_frames, error);
    beyond += error > kMicrosecond_frames;
  }
  EXPECT_LT(static_cast<double>(beyond) / kDirections, 0.015);
  EXPECT_LT(worst_frames, 10 * kMicrosecond_frames);
  EXPECT_LT(worst_below_frames, 30 * kMicrosecond_frames);
}

}  // namespace
}  // namespace clamor
