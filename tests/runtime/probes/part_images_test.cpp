// part_images_test.cpp: where the images of sources in movable parts are, and which there are.
#include "runtime/probes/part_images.h"

#include <cmath>
#include <vector>

#include <gtest/gtest.h>

#include "runtime/occlusion/part_shape.h"

namespace clamor {
namespace {

constexpr Vec3 kNearPart_m(3, 0.2, 0.3);

// Emitters, moving sources, and a door of 1 x 2 m across x = 0 that reflects 0.9.
class Stage {
 public:
  explicit Stage(std::vector<Vec3> emitters_m)
      : emitters_(emitters_of(std::move(emitters_m))),
        radiation_(emitters_, materials_, {}),
        moving_(4, 1),
        list_(moving_, radiation_, weights_, emitters_, 1),
        images_(scene_, std::span(emitters_).first(emitters_.size() - 1), radiation_, weights_,
                &list_) {
    door_ = *parts_.add(*PartShape::make(box_mesh({0.02, 1, 0.5}, 0), materials_), {});
    move({});
  }

  void move(const PartPose& pose) {
    ASSERT_TRUE(parts_.move(door_, pose).ok());
    scene_.update(parts_);
  }
  void disable() {
    ASSERT_TRUE(parts_.enable(door_, false).ok());
    scene_.update(parts_);
  }
  const std::vector<FoundSource>& keyframe(double time_s, const Vec3& listener_m = kNearPart_m,
                                           double threshold = 0) {
    (void)list_.refresh();
    const QueryKeyframe keyframe{listener_m, time_s};
    list_.begin(keyframe);
    images_.begin(keyframe);
    found_.clear();
    images_.find_above(threshold, found_.max_size(), found_);
    return found_;
  }
  MovingSources& moving() { return moving_; }
  const RadiationModel& radiation() const { return radiation_; }
  const SignalWeights& weights() const { return weights_; }
  PartImages& images() { return images_; }

 private:
  // The last one is the kind of moving sources.
  static std::vector<Emitter> emitters_of(std::vector<Vec3> places_m) {
    std::vector<Emitter> emitters;
    for (const Vec3& place_m : places_m) emitters.emplace_back().position_m = place_m;
    emitters.emplace_back();
    return emitters;
  }

  const std::vector<Material> materials_ = {mirror_material()};
  const SignalWeights weights_{{{1, 2, 3, 4, 5, 4, 3, 2}}};
  const std::vector<Emitter> emitters_;
  RadiationModel radiation_;
  MovingParts parts_;
  PartScene scene_;
  PartHandle door_;
  MovingSources moving_;
  MovingSourceList list_;
  PartImages images_;
  std::vector<FoundSource> found_;
};

void expect_near(const Vec3f& a, const Vec3& b) {
  EXPECT_LT(length(Vec3(a) - b), 1e-4) << a.x << " " << a.y << " " << a.z;
}

TEST(PartImages, AreMirroredInTheFaceThatSourceAndListenerSee) {
  Stage stage({{2, 0.5, 0.1}});
  const auto& found = stage.keyframe(0);
  ASSERT_EQ(found.size(), 1u);
  const Source& image = *found[0].source;
  expect_near(image.position_m, {-1.96, 0.5, 0.1});
  expect_near(image.original_m, {2, 0.5, 0.1});
  EXPECT_TRUE(image.is_image && image.is_emitter);
  EXPECT_TRUE(image.is_in_part);
  // Neither behind the door nor for a listener there.
  EXPECT_TRUE(stage.keyframe(0.02, {-3, 0.2, 0.3}).empty());
  EXPECT_TRUE(Stage({{-2, 0.5, 0.1}}).keyframe(0).empty());
  EXPECT_EQ(Stage({{-2, 0.5, 0.1}}).keyframe(0, {-3, 0, 0}).size(), 1u);
  stage.disable();
  EXPECT_TRUE(stage.keyframe(0.04).empty());
}

TEST(PartImages, AreOnlyWhereTheirPathComesNearTheFace) {
  EXPECT_EQ(Stage({{2, 1.8, 0.1}}).keyframe(0).size(), 1u);
  EXPECT_TRUE(Stage({{2, 9, 0.1}}).keyframe(0).empty());
}

TEST(PartImages, MoveWithTheirPartTwiceAsFast) {
  Stage stage({{2, 0.5, 0.1}});
  const std::uint64_t number = stage.keyframe(0)[0].voice;
  stage.move({{-0.02, 0, 0}});  // at 1 m/s
  const auto& found = stage.keyframe(0.02);
  ASSERT_EQ(found.size(), 1u);
  EXPECT_EQ(found[0].voice, number);
  expect_near(found[0].source->position_m, {-2, 0.5, 0.1});
  EXPECT_NEAR(found[0].velocity_mps.x, -2, 0.01);
  EXPECT_EQ(stage.keyframe(0.04)[0].velocity_mps, Vec3f(0)) << "it has stopped";
  const auto half = static_cast<float>(std::sqrt(0.5));
  stage.move({{}, Rotation(half, 0, half, 0)});  // by 90 degrees about y
  EXPECT_TRUE(stage.keyframe(0.06, {3, 0, -1}).empty()) << "on the other side of the leaf";
}

TEST(PartImages, OfMovingSourcesFollowThem) {
  Stage stage({});
  MovingSource source;
  source.position_m = {2, 0.5, 0.1};
  source.velocity_mps = {1, 0, 0.5};
  ASSERT_TRUE(stage.moving().add(source).ok());
  stage.moving().commit();
  const auto& found = stage.keyframe(0);
  ASSERT_EQ(found.size(), 1u);
  // It is heard from where it was: some 5 m of sound ago, at 1.1 m/s.
  EXPECT_NEAR(found[0].source->position_m.x, 0.04 - 2, 0.02);
  EXPECT_NEAR(found[0].velocity_mps.x, -1, 1e-3);
  EXPECT_NEAR(found[0].velocity_mps.z, 0.5, 1e-3);
  const std::uint64_t number = found[0].voice;
  EXPECT_EQ(stage.keyframe(0.02)[0].voice, number);
}

// The bound is that of the face, and holds for what arrives.
TEST(PartImages, HaveUpperBoundsOfTheirPriorities) {
  Stage stage({{2, 0.5, 0.1}, {4, 0.2, 0}});
  const auto all = stage.keyframe(0);
  ASSERT_EQ(all.size(), 2u);
  double highest = 0;
  for (const FoundSource& one : all) {
    const Bands intensity = stage.radiation().intensity(*one.source, kNearPart_m);
    double priority = 0;
    for (std::size_t b = 0; b < kBandCount; ++b)
      priority += 0.9 * static_cast<double>(intensity[b]) *
                  static_cast<double>(stage.weights().by_signal[0][b]);
    EXPECT_GE(one.upper_bound, priority);
    EXPECT_LT(one.upper_bound, 1.5 * priority);
    highest = std::max(highest, one.upper_bound);
  }
  EXPECT_EQ(stage.images().upper_bound(), highest);
  EXPECT_TRUE(stage.keyframe(0.02, kNearPart_m, 1.01 * highest).empty());
}

TEST(PartImages, AreThoseOfTheLoudestInACrowd) {
  std::vector<Vec3> crowd;
  for (int i = 0; i < 200; ++i) crowd.emplace_back(2 + 0.05 * i, 0.1, 0.1);
  Stage stage(crowd);
  const auto& found = stage.keyframe(0);
  EXPECT_EQ(found.size(), PartImages::kMaxImages);
  for (const FoundSource& one : found) EXPECT_LT(one.source->original_m.x, 2 + 0.05 * 90);
}

}  // namespace
}  // namespace clamor
