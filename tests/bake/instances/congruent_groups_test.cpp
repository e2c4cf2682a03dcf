#include "bake/instances/congruent_groups.h"

#include <functional>

#include <gtest/gtest.h>

#include "tests/stadium_level.h"

namespace clamor {
namespace {

using testing::Frame;
using testing::StadiumLevel;

StadiumLevel stadium_level() {
  StadiumLevel all;
  all.build();
  return all;
}

std::size_t instances_in(const std::vector<Congruence>& found) {
  std::size_t copies = 0;
  for (std::size_t g = 0; g < found.size(); ++g) copies += found[g].prototype != g;
  return copies;
}

// Compares every instance, as the file will place it, with the emitters it replaces.
void expect_true_instances(const StadiumLevel& all, const std::vector<Congruence>& found,
                           const UniqueSignalMaps& maps) {
  for (std::size_t g = 0; g < found.size(); ++g) {
    const SceneGroup &group = all.groups[g], &model = all.groups[found[g].prototype];
    ASSERT_EQ(found[found[g].prototype].prototype, found[g].prototype);
    ASSERT_EQ(group.size(), model.size());
    const Placement placed = Placement{}.then(found[g].instance);
    for (std::size_t i = 0; i < group.size(); ++i) {
      const Emitter& from = all.level.emitters[model.first + i];
      const Emitter& to = all.level.emitters[group.first + i];
      ASSERT_LT(length(placed.outside(from.position_m) - to.position_m), 1e-3);
      ASSERT_LT(length(placed.rotation * from.axis - to.axis), 1e-4);
      ASSERT_NEAR(from.gain * static_cast<double>(found[g].instance.gain), to.gain,
                  0.002 * to.gain);
      ASSERT_NEAR(from.delay_s + placed.delay_s, to.delay_s, 1 / 48000.0);
      const std::uint32_t map = found[g].instance.signals;
      ASSERT_EQ(map == kSameSignals ? from.signal : maps.all()[map][from.signal], to.signal);
    }
  }
}

TEST(CongruentGroups, IncludeAllBlocksAndStandsOfAStadium) {
  const StadiumLevel all = stadium_level();
  for (const PrototypeIs model_is : {PrototypeIs::kFirstInList, PrototypeIs::kFirstToSound}) {
    UniqueSignalMaps maps;
    const auto found = find_congruent_groups(all.level, all.groups, model_is, maps);
    EXPECT_EQ(instances_in(found), 6 * 4 - 1 + 3u);
    expect_true_instances(all, found, maps);
    for (std::size_t g = 0; g < found.size(); ++g) {
      if (model_is == PrototypeIs::kFirstToSound) {
        EXPECT_GE(found[g].instance.delay_s, 0);
      } else {
        EXPECT_LE(all.groups[found[g].prototype].first, all.groups[g].first);
      }
    }
  }
}

// Each change makes block 3 of stand 2, and so stand 2, unlike any other.
TEST(CongruentGroups, ExcludeGroupsThatOnlyLookAlike) {
  const std::function<void(Emitter&)> changes[] = {
      [](Emitter& fan) { fan.position_m.x += 0.02; },
      [](Emitter& fan) { fan.gain *= 1.1; },
      [](Emitter& fan) { fan.directivity[5] += 0.5f; },
      [](Emitter& fan) { fan.delay_s += 0.001; },
      [](Emitter& fan) { fan.signal = (fan.signal + 1) % 5; },
      [](Emitter& fan) { fan.axis = normalize(fan.axis + Vec3(0, 0.01, 0)); },
  };
  for (const auto& change : changes) {
    StadiumLevel all = stadium_level();
    const std::size_t block = 2 * 7 + 3, stand = 2 * 7 + 6;
    change(all.level.emitters[all.groups[block].first + 11]);
    UniqueSignalMaps maps;
    const auto found =
        find_congruent_groups(all.level, all.groups, PrototypeIs::kFirstInList, maps);
    EXPECT_EQ(instances_in(found), 6 * 4 - 2 + 2u);
    EXPECT_EQ(found[block].prototype, block);
    EXPECT_EQ(found[stand].prototype, stand);
    expect_true_instances(all, found, maps);
  }
}

// Two equal blocks in different frames.
StadiumLevel two_blocks(const Frame& second, double gain = 1) {
  StadiumLevel all;
  all.blocks = 1;
  all.stands = 2;
  all.build();
  // The two blocks; a stand of one block is the same range.
  all.groups = {all.groups[0], all.groups[2]};
  const SceneGroup& first = all.groups[0];
  const Matrix way = second.axes * glm::inverse(first.axes);
  for (std::size_t i = 0; i < 40; ++i) {
    const Emitter& from = all.level.emitters[i];
    Emitter& to = all.level.emitters[40 + i];
    to = from;
    to.position_m = second.origin_m + way * (from.position_m - first.origin_m);
    to.axis = normalize(way * from.axis);
    to.gain = from.gain * gain;
  }
  all.groups[1].axes = second.axes;
  all.groups[1].origin_m = second.origin_m;
  return all;
}

bool second_is_copy(const StadiumLevel& all) {
  UniqueSignalMaps maps;
  const auto found = find_congruent_groups(all.level, all.groups, PrototypeIs::kFirstInList, maps);
  expect_true_instances(all, found, maps);
  return instances_in(found) == 1;
}

TEST(CongruentGroups, AllowRotationShrinkingAndGainButNotMirroringStretchingOrEnlarging) {
  const Frame turned = {glm::mat3_cast(glm::angleAxis(1.1, normalize(Vec3(1, 2, -0.5)))),
                        {12, -3, 55}};
  const auto scaled = [&](const Vec3& by) {
    Frame frame = turned;
    for (int axis = 0; axis < 3; ++axis) frame.axes[axis] *= by[axis];
    return frame;
  };
  EXPECT_TRUE(second_is_copy(two_blocks(turned)));
  EXPECT_TRUE(second_is_copy(two_blocks(turned, 3.5)));
  EXPECT_TRUE(second_is_copy(two_blocks(scaled(Vec3(0.4)))));
  EXPECT_FALSE(second_is_copy(two_blocks(scaled(Vec3(1.2)))));
  EXPECT_FALSE(second_is_copy(two_blocks(scaled({1, 1, 0.98}))));
  EXPECT_FALSE(second_is_copy(two_blocks(scaled({-1, 1, 1}))));
  EXPECT_FALSE(second_is_copy(two_blocks(scaled({1, 0, 1}))));
}

// Far from the origin, a rotation stored as floats would displace fans by more than the tolerance.
TEST(CongruentGroups, AreRejectedWhereFloatsCannotPlaceThem) {
  const Frame far = {glm::mat3_cast(glm::angleAxis(1.1, Vec3(0, 1, 0))), {500'000, 0, 300'000}};
  second_is_copy(two_blocks(far));  // either answer must be correct
}

}  // namespace
}  // namespace clamor
