// probe_zones_test.cpp: which probes share their late reflections.
#include "bake/probes/probe_zones.h"

#include <array>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/bake/probes/probe_levels.h"

namespace clamor {
namespace {

// A source in a doorway sends half of its sound into the other room, one beside it hardly any. The
// four places lie near enough together to be one zone otherwise.
TEST(ProbeZones, GiveADoorwayAZoneOfItsOwn) {
  const Mesh rooms = testing::two_rooms_mesh();
  const Scene scene(rooms);
  const std::array places_m = {Vec3(4.2, 1.5, 2.5), Vec3(4.5, 1.5, 1.5), Vec3(6, 1.5, 2.5),
                               Vec3(7.5, 1.5, 2.5)};
  const ProbeZones zones = group_probes(scene, {}, places_m);
  EXPECT_THAT(zones.sizes, ::testing::ElementsAre(2, 1, 1));
  EXPECT_THAT(zones.order, ::testing::ElementsAre(0, 1, 2, 3));
}

}  // namespace
}  // namespace clamor
