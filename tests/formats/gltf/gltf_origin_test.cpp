#include "formats/gltf/gltf_origin.h"

#include <string>

#include <gmock/gmock.h>

#include "tests/formats/level_builder.h"

namespace clamor::testing {
namespace {

using ::testing::HasSubstr;

class FarLevel : public LevelTest {
 protected:
  // A triangle, a door and a sidecar's places, all moved.
  ImportedLevel moved_by(const Vec3& moved_m) {
    level_ = {{"asset", {{"version", "2.0"}}}};
    bin_.clear();
    const auto at = [&](double x, double y, double z) {
      return json{moved_m.x + x, moved_m.y + y, moved_m.z + z};
    };
    triangle();
    level_["nodes"][0]["translation"] = at(0.25, 1, 2);
    node({{"mesh", 0}, {"name", "Leaf"}, {"translation", at(1, 0.5, 3)}});
    level_["scenes"] = {{{"nodes", {0, 1}}}};
    write("level.acoustics.json",
          json{{"movable", {"Leaf"}},
               {"emitters", {{{"name", "hum"}, {"signal", "noise"}, {"at", at(1, 1.5, 2)}}}},
               {"probes", {{{"at", at(2, 1, 0.5)}}}},
               {"listeners", {{{"name", "here"}, {"at", at(3, 1, 1)}}}},
               {"portals",
                {{{"name", "Gap"}, {"at", at(0, 1, 0)}, {"size", {1, 2}}, {"facing", {1, 0, 0}}}}}}
              .dump());
    const std::string beep = "name=beep,signal=impulse,at=" + std::to_string(moved_m.x + 1) + "," +
                             std::to_string(moved_m.y) + "," + std::to_string(moved_m.z);
    auto imported = import({.emitters = {beep}});
    EXPECT_TRUE(imported.ok()) << imported.error().message;
    return imported.ok() ? std::move(*imported) : ImportedLevel{};
  }
};

// The largest coordinate has 2^-30 m between its double-precision numbers.
TEST_F(FarLevel, HasTheNumbersOfTheOneAtTheOrigin) {
  constexpr double kRounding_m = 1e-9;
  const ImportedLevel near = moved_by({0, 0, 0});
  EXPECT_EQ(near.level.origin_m, Vec3(0));
  for (const Vec3& moved_m : {Vec3(1000, 0, -700), Vec3(530'100, 0, -180'400),
                              Vec3(500'000, 0, -4'649'700), Vec3(2'600'000, 400, 1'200'000)}) {
    const ImportedLevel far = moved_by(moved_m);
    EXPECT_EQ(far.level.origin_m, moved_m);
    EXPECT_EQ(far.level.mesh.vertices_m, near.level.mesh.vertices_m);
    ASSERT_EQ(far.level.emitters.size(), 2u);
    for (std::size_t i = 0; i < 2; ++i)
      EXPECT_LT(length(far.level.emitters[i].position_m - near.level.emitters[i].position_m),
                kRounding_m);
    EXPECT_LT(length(far.level.probes_m.at(0) - near.level.probes_m.at(0)), kRounding_m);
    EXPECT_LT(length(far.level.portals.at(0).centre_m - near.level.portals.at(0).centre_m),
              kRounding_m);
    EXPECT_LT(length(far.listeners.at(0).at_m - near.listeners.at(0).at_m), kRounding_m);
    const MovablePart &leaf = far.level.movable_parts.at(0), &there = near.level.movable_parts[0];
    EXPECT_EQ(leaf.mesh, there.mesh);
    EXPECT_LT(length(leaf.rest_pose.position_m - there.rest_pose.position_m), kRounding_m);
  }
}

TEST_F(FarLevel, IsNotWhereASingleObjectIsFarAway) {
  triangle();
  for (const double x : {0.0, 1.0, 2.0, 40'000.0}) node({{"mesh", 0}, {"translation", {x, 0, 0}}});
  EXPECT_EQ(level().origin_m, Vec3(0));
}

TEST_F(FarLevel, HasNoEmitterMoreThanAThousandKilometresAway) {
  triangle();
  level_["nodes"][0]["translation"] = {530'123, 0, -2'600'000};
  EXPECT_THAT(refusal({.emitters = {"signal=noise,at=1,1,1"}}),
              HasSubstr("lies 2653 km from the level, where 1000 km are the most; the middle of "
                        "the level is near 530100, 0, -2600000."));
}

}  // namespace
}  // namespace clamor::testing
