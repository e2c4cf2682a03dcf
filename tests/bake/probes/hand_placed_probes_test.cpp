// hand_placed_probes_test.cpp: probes that the level names stay where they are.
#include <gtest/gtest.h>

#include "tests/bake/probes/probe_levels.h"

namespace clamor {
namespace {

using testing::add_box;
using testing::box;
using testing::every;
using testing::level_of;
using testing::placed;

class HandPlacedProbes : public ::testing::Test {
 protected:
  HandPlacedProbes() : level_(level_of(box({10, 3, 10}), {1, 1, 1})) {
    level_.probes_m = {{4.321, 1.234, 5.678}, {8, 0.5, 8}};
  }

  Level level_;
};

TEST_F(HandPlacedProbes, ComeFirstAndAutomaticOnesKeepHalfASpacingAway) {
  const ProbePlacement placement = placed(level_, every(2));

  ASSERT_GT(placement.positions_m.size(), 10u);
  EXPECT_EQ(placement.hand_placed, 2u);
  EXPECT_EQ(placement.positions_m[0], level_.probes_m[0]);
  EXPECT_EQ(placement.positions_m[1], level_.probes_m[1]);
  for (std::size_t i = 2; i < placement.positions_m.size(); ++i)
    for (const Vec3& probe_m : level_.probes_m)
      EXPECT_GE(length(placement.positions_m[i] - probe_m), 1);
  EXPECT_TRUE(placement.warnings.empty());
}

TEST_F(HandPlacedProbes, AreTheOnlyOnesWithoutAPlacement) {
  ProbeOptions options;
  options.placement = ProbeOptions::Placement::kNone;
  EXPECT_EQ(placed(level_, options).positions_m, level_.probes_m);
}

TEST_F(HandPlacedProbes, ShowWhereSourcesAreLikeEmitters) {
  level_.emitters.clear();
  EXPECT_GT(placed(level_, every(2)).positions_m.size(), 10u);
}

TEST_F(HandPlacedProbes, InASolidOrOutsideAreKeptAndReported) {
  add_box(level_.mesh, {7, 0, 2}, {7.5, 3, 2.5});
  level_.probes_m = {{7.25, 1, 2.25}, {30, 1, 5}, {2, 1, 2}};
  const ProbePlacement placement = placed(level_, every(2));

  for (std::size_t i = 0; i < 3; ++i) EXPECT_EQ(placement.positions_m[i], level_.probes_m[i]);
  ASSERT_EQ(placement.warnings.size(), 2u);
  EXPECT_TRUE(placement.warnings[0].starts_with("probe 1 at 7.25,1,2.25 lies inside a solid"))
      << placement.warnings[0];
  EXPECT_TRUE(placement.warnings[1].starts_with("probe 2 at 30,1,5 lies outside the level"))
      << placement.warnings[1];
}

}  // namespace
}  // namespace clamor
