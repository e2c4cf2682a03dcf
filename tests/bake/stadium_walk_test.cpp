// Tests of the walk that tools/demo plays: a person can walk there.

#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "bake/trace/scene.h"
#include "formats/gltf/level_import.h"
#include "formats/level/walk_file.h"
#include "tests/build_paths.h"

namespace clamor {
namespace {

const std::string kLevels = std::string(testing::kSourceDir) + "/assets/levels/";

class StadiumWalk : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    level_ = new Result<ImportedLevel>(import_level(kLevels + "stadium.glb", {}));
    ASSERT_TRUE(level_->ok()) << level_->error().message;
    scene_ = new Scene((*level_)->level.mesh, Scene::Build::kQuick);
    walk_ = new Result<Walk>(Walk::read(kLevels + "stadium_walk.json"));
    ASSERT_TRUE(walk_->ok()) << walk_->error().message;
  }
  static void TearDownTestSuite() {
    delete scene_;
    delete level_;
    delete walk_;
  }

  // Eye positions at every half metre of the walk, and its end.
  static std::vector<Vec3> places(double step_m) {
    std::vector<Vec3> places{(*walk_)->at(0).position_m};
    for (double t = 0; t < (*walk_)->length_s(); t += 0.01) {
      const Vec3 here = (*walk_)->at(t).position_m;
      if (length(here - places.back()) >= step_m) places.push_back(here);
    }
    places.push_back((*walk_)->at((*walk_)->length_s()).position_m);
    return places;
  }

  static Result<ImportedLevel>* level_;
  static Scene* scene_;
  static Result<Walk>* walk_;
};
Result<ImportedLevel>* StadiumWalk::level_ = nullptr;
Scene* StadiumWalk::scene_ = nullptr;
Result<Walk>* StadiumWalk::walk_ = nullptr;

TEST_F(StadiumWalk, LeadsFromThePitchIntoTheStandsInNinetySeconds) {
  const Vec3 first = (*walk_)->at(0).position_m, last = places(0.5).back();
  EXPECT_NEAR(length(first - Vec3(0, 1.7, 0)), 0, 0.01);
  EXPECT_GE((*walk_)->length_s(), 60);
  EXPECT_LE((*walk_)->length_s(), 90);
  std::size_t near = 0;  // within earshot
  for (const Emitter& emitter : (*level_)->level.emitters)
    near += length(emitter.position_m - last) < 5;
  EXPECT_GT(near, 30u);
}

TEST_F(StadiumWalk, HasAFloorUnderTheFeet) {
  double highest_m = 0;
  for (const Vec3& eyes : places(0.5)) {
    const auto floor = scene_->intersect(eyes, {0, -1, 0});
    ASSERT_TRUE(floor) << eyes.x << ' ' << eyes.y << ' ' << eyes.z;
    // Eyes are 1.7 m above the line through the middle of the steps, which are at most 0.2 m high.
    EXPECT_NEAR(floor->distance_m, 1.7, 0.11) << eyes.x << ' ' << eyes.y << ' ' << eyes.z;
    EXPECT_GT(floor->normal.y, 0.99);
    highest_m = std::max(highest_m, eyes.y - floor->distance_m);
  }
  EXPECT_GT(highest_m, 6);  // the walkway above the lower tier
}

TEST_F(StadiumWalk, CollidesWithNothingAtHeadOrKneeHeight) {
  const std::vector<Vec3> way = places(0.5);
  for (std::size_t i = 1; i < way.size(); ++i)
    for (const double below_m : {0.0, 1.1}) {
      const Vec3 from = way[i - 1] - Vec3(0, below_m, 0), to = way[i] - Vec3(0, below_m, 0);
      if (length(to - from) < 1e-6) continue;
      const auto hit = scene_->intersect(from, normalize(to - from));
      EXPECT_TRUE(!hit || hit->distance_m > length(to - from))
          << from.x << ' ' << from.y << ' ' << from.z << ", " << below_m << " m below the eyes";
    }
}

// Fans and rails keep enough distance to walk upright without squeezing through.
TEST_F(StadiumWalk, HasSpaceForTheShoulders) {
  for (const Vec3& eyes : places(0.5))
    for (const double below_m : {0.0, 0.4, 1.1})
      for (int i = 0; i < 16; ++i) {
        const double angle = 2 * std::numbers::pi * i / 16;
        const auto hit =
            scene_->intersect(eyes - Vec3(0, below_m, 0), {std::cos(angle), 0, std::sin(angle)});
        // Stairs rise towards the knees: half a metre at 1 in 1.75 plus one step.
        EXPECT_TRUE(!hit || hit->distance_m > 0.35)
            << eyes.x << ' ' << eyes.y << ' ' << eyes.z << ", " << below_m << " m below, "
            << hit->distance_m << " m at " << i;
      }
}

}  // namespace
}  // namespace clamor
