#include "runtime/probes/first_reflections.h"

#include <array>
#include <cmath>
#include <set>
#include <vector>

#include <gtest/gtest.h>

#include "common/directivity.h"
#include "runtime/occlusion/moving_parts.h"
#include "runtime/occlusion/occlusion_geometry.h"
#include "runtime/occlusion/part_scene.h"
#include "runtime/occlusion/part_shape.h"
#include "tests/box_mesh.h"

namespace clamor {
namespace {

constexpr std::size_t kSets = FirstReflectionTracer::kSets;

// The first reflections of sources in a hall of 20 x 30 x 6 m that absorbs nothing, without images,
// or has mirrors on all sides.
class Hall {
 public:
  explicit Hall(std::size_t sources = 1,
                std::vector<Material> materials = {testing::uniform_material(0)},
                bool with_images = false)
      : materials_(std::move(materials)),
        surfaces_(mesh_, materials_),
        reflections_(surfaces_, FirstReflectionTracer(surfaces_, materials_, {}, {}), bounds_,
                     sources, with_images) {}

  // A keyframe with sources at these places.
  void keyframe(std::span<const Vec3> places_m, std::uint32_t generation = 1,
                const Vec3& listener_m = kListener_m) {
    reflections_.begin(listener_m);
    for (std::size_t s = 0; s < places_m.size(); ++s)
      reflections_.add(s, generation, places_m[s], 1, same_in_all_bands(1));
    reflections_.trace();
    reflections_.find_above({10, 15, 3}, 0, found_);  // all
    radiator_.position_m = places_m.back();
  }

  // Power of the last source's reflections in the lowest band, in parts of what it radiates.
  double power() const {
    double sum = 0;
    for (const auto& one : found_)
      if (one.source == found_.back().source)
        sum += static_cast<double>(reflections_.moved(one, radiator_).power[0]);
    return sum / emission_power(0);
  }
  std::set<std::uint64_t> numbers() const {
    std::set<std::uint64_t> all;
    for (const auto& one : found_) all.insert(reflections_.number(one));
    return all;
  }
  // How many of the numbers are not among the others.
  std::size_t new_numbers(const std::set<std::uint64_t>& others) const {
    std::size_t count = 0;
    for (const std::uint64_t number : numbers()) count += others.count(number) == 0;
    return count;
  }

  // So far away that no cone is divided.
  static constexpr Vec3 kListener_m{1e5, 0, 0};
  OcclusionGeometry& surfaces() { return surfaces_; }
  const FirstReflections& reflections() const { return reflections_; }
  std::span<const FirstReflections::Found> found() const { return found_; }

 private:
  const std::vector<Material> materials_;
  const Mesh mesh_ = testing::box({20, 30, 6});
  const ProbeBounds bounds_{materials_, {}, {}};
  OcclusionGeometry surfaces_;
  FirstReflections reflections_;
  std::vector<FirstReflections::Found> found_;
  MovingRadiator radiator_;
};

// The flux of a source through a closed surface does not depend on where in it the source is. At
// 30 m/s the oldest set was traced 3.6 m ago.
TEST(FirstReflections, KeepTheWholePowerOfASourceHoweverFastItMoves) {
  for (const double speed_mps : {0.0, 1.5, 30.0}) {
    Hall hall;
    for (int k = 0; k < 40; ++k) {
      const Vec3 place_m(5 + 0.2 * speed_mps / 30 * k, 5 + 0.6 * speed_mps / 30 * k, 1.6);
      hall.keyframe({&place_m, 1});
      EXPECT_NEAR(hall.power(), 1, speed_mps > 10 ? 0.1 : 0.06) << speed_mps << " " << k;
    }
  }
}

TEST(FirstReflections, StayUntilTheSourceHasMovedByAQuarterOfItsDistanceToASurface) {
  Hall hall;
  const Vec3 place_m(5, 5, 2);
  hall.keyframe({&place_m, 1});
  const auto numbers = hall.numbers();
  EXPECT_EQ(numbers.size(), FirstReflectionTracer::kRays);
  EXPECT_TRUE(hall.reflections().is_settled());
  const Vec3 near_m = place_m + Vec3(0.45, 0, 0);
  hall.keyframe({&near_m, 1});
  EXPECT_EQ(hall.new_numbers(numbers), 0u);
  EXPECT_TRUE(hall.reflections().is_settled());
  const Vec3 far_m = place_m + Vec3(0.6, 0, 0);
  for (std::size_t k = 0; k < kSets; ++k) {
    EXPECT_EQ(hall.new_numbers(numbers), k * FirstReflectionTracer::kRaysOfSet);
    hall.keyframe({&far_m, 1});
  }
  EXPECT_EQ(hall.new_numbers(numbers), FirstReflectionTracer::kRays);
  hall.keyframe({&far_m, 1});
  EXPECT_TRUE(hall.reflections().is_settled());
}

TEST(FirstReflections, ChangeByASetAtMostInAKeyframe) {
  Hall hall;
  Vec3 place_m(5, 5, 2);
  hall.keyframe({&place_m, 1});
  for (int k = 0; k < 20; ++k) {
    const auto before = hall.numbers();
    place_m.y += 0.6;
    hall.keyframe({&place_m, 1});
    EXPECT_LE(hall.new_numbers(before), FirstReflectionTracer::kRaysOfSet);
  }
  auto before = hall.numbers();
  hall.keyframe({&place_m, 1}, 2);  // another source
  EXPECT_EQ(hall.new_numbers(before), hall.numbers().size());
  before = hall.numbers();
  place_m.x += 10;  // it leaps
  hall.keyframe({&place_m, 1}, 2);
  EXPECT_EQ(hall.new_numbers(before), hall.numbers().size());
  EXPECT_EQ(hall.numbers().size(), FirstReflectionTracer::kRays);
}

// A source has an image in each of the hall's six sides, wherever it is, and what the mirrors
// scatter stays with the traced reflections.
TEST(FirstReflections, GiveWhatMirrorsReflectToImages) {
  constexpr float kAbsorption = 0.2f, kScattering = 0.25f;
  Hall hall(1, {testing::uniform_material(kAbsorption, kScattering, kMirrorExponent)}, true);
  std::set<std::uint32_t> numbers;
  for (int k = 0; k < 40; ++k) {
    const Vec3 place_m(4 + 0.3 * k, 5 + 0.5 * k, 1.6);
    hall.keyframe({&place_m, 1});
    std::size_t images = 0;
    double nearest_m = 0;  // sum over the sides
    hall.reflections().for_each_image(
        [&](std::uint32_t source, const SourceMirrors::Mirror& mirror) {
          EXPECT_EQ(source, 0u);
          numbers.insert(mirror.number);
          ++images;
          nearest_m += length(mirror.plane.image_of(place_m) - place_m) / 2;
        });
    EXPECT_EQ(images, 6u) << k;
    EXPECT_NEAR(nearest_m, 20 + 30 + 6, 0.001) << k;
    EXPECT_NEAR(hall.power(), (1 - kAbsorption) * kScattering, 0.02) << k;
  }
  EXPECT_EQ(numbers.size(), 6u);  // the same images all the time
}

// In a crowd the loudest sources have images, and they keep them while nobody is much louder.
TEST(FirstReflections, GiveImagesToTheNearestOfACrowd) {
  constexpr std::size_t kCount = 100, kImaged = 64;
  Hall hall(kCount, {testing::uniform_material(0, 0, kMirrorExponent)}, true);
  const Vec3 listener_m(1, 1, 1.6);
  const auto imaged = [&](double shift_m) {
    std::vector<Vec3> places_m;
    for (std::size_t s = 0; s < kCount; ++s)
      places_m.push_back({10, 3 + shift_m + 0.2 * static_cast<double>(s), 1.6});
    hall.keyframe(places_m, 1, listener_m);
    std::set<std::uint32_t> sources;
    hall.reflections().for_each_image(
        [&](std::uint32_t source, const SourceMirrors::Mirror&) { sources.insert(source); });
    return sources;
  };
  const auto first = imaged(0);
  EXPECT_EQ(first.size(), kImaged);
  EXPECT_EQ(*first.rbegin(), kImaged - 1);
  EXPECT_EQ(imaged(0.5), first);
}

TEST(FirstReflections, FollowAListenerWhoWalksAlongAWall) {
  Hall hall;
  const Vec3 place_m(18, 15, 2), listener_m(0.5, 15, 1.6);
  hall.keyframe({&place_m, 1}, 1, listener_m);
  const auto numbers = hall.numbers();
  EXPECT_GT(numbers.size(), FirstReflectionTracer::kRays + 16);
  EXPECT_NEAR(hall.power(), 1, 0.02);
  hall.keyframe({&place_m, 1}, 1, listener_m + Vec3(0, 0.1, 0));
  EXPECT_EQ(hall.new_numbers(numbers), 0u);
  for (std::size_t k = 0; k < 2 * kSets; ++k)
    hall.keyframe({&place_m, 1}, 1, listener_m + Vec3(0, 1, 0));
  EXPECT_GT(hall.new_numbers(numbers), FirstReflectionTracer::kRays / 2);
  EXPECT_NEAR(hall.power(), 1, 0.02);
  EXPECT_TRUE(hall.reflections().is_settled());
}

// A crowd shares the budget; those that wait keep the reflections that they have.
TEST(FirstReflections, OfManySourcesAreTracedByTurns) {
  constexpr std::size_t kSources = 400;
  Hall hall(kSources);
  std::vector<Vec3> places_m;
  for (std::size_t s = 0; s < kSources; ++s)
    places_m.emplace_back(2 + 0.025 * static_cast<double>(s), 20 - 0.025 * static_cast<double>(s),
                          1.6);
  hall.keyframe(places_m);
  // All sound from the first keyframe on.
  EXPECT_GE(hall.found().size(), kSources * FirstReflectionTracer::kRaysOfSet);
  EXPECT_NEAR(hall.power(), 1, 0.06);
  int keyframes = 1;
  while (!hall.reflections().is_settled() && keyframes < 100) {
    const auto before = hall.numbers();
    hall.keyframe(places_m);
    EXPECT_LE(hall.new_numbers(before), 1050u);
    ++keyframes;
  }
  // 400 second sets, 25 of them in a keyframe; there is no room for a third of each.
  EXPECT_LE(keyframes, 19);
  EXPECT_EQ(hall.found().size(), kSources * 2 * FirstReflectionTracer::kRaysOfSet);
  EXPECT_NEAR(hall.power(), 1, 0.06);
}

TEST(FirstReflections, AreTracedAgainWhenAPartHasMoved) {
  Hall hall;
  const Vec3 place_m(5, 5, 2);
  hall.keyframe({&place_m, 1});
  const double free = hall.power();
  MovingParts parts;
  const std::vector<Material> materials = {testing::uniform_material(0)};
  const auto screen = PartShape::make(testing::box({0.1, 4, 4}), materials);
  ASSERT_TRUE(screen.ok());
  ASSERT_TRUE(parts.add(*screen, {.position_m = {5.5, 3, 0}}).ok());
  PartScene scene;
  scene.update(parts);
  hall.surfaces().set_parts(&scene);
  for (int k = 0; k < 20; ++k) hall.keyframe({&place_m, 1});
  EXPECT_TRUE(hall.reflections().is_settled());
  // A square of half-width a seen from h covers 4 asin(a^2 / (a^2 + h^2)) of the sphere.
  const double covered = 4 * std::asin(4 / 4.25) / emission_power(0);
  EXPECT_NEAR(hall.power(), free - covered, 0.02);
}

}  // namespace
}  // namespace clamor
