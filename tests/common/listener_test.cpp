#include "common/listener.h"

#include <cmath>
#include <initializer_list>
#include <numbers>

#include <gtest/gtest.h>

namespace clamor {
namespace {

constexpr double kQuarterTurn_rad = std::numbers::pi / 2;

void expect_same_vector(const Vec3& a, const Vec3& b, double tolerance = 1e-15) {
  EXPECT_LE(length(a - b), tolerance) << a.x << ' ' << a.y << ' ' << a.z;
}

TEST(Listener, LooksAlongMinusZAndTurnsToTheLeft) {
  expect_same_vector(Listener().forward(), {0, 0, -1});
  expect_same_vector(Listener().right(), {1, 0, 0});
  expect_same_vector(Listener().up(), {0, 1, 0});
  expect_same_vector(Listener({}, kQuarterTurn_rad, 0).forward(), {-1, 0, 0});
  expect_same_vector(Listener({}, 0, kQuarterTurn_rad).forward(), {0, 1, 0});
  for (const double yaw : {0.3, 2.0, -1.0}) {
    const Listener listener({}, yaw, 0.4);
    EXPECT_NEAR(length(listener.forward()), 1, 1e-15);
    EXPECT_NEAR(dot(listener.forward(), listener.right()), 0, 1e-15);
  }
}

TEST(Listener, RollsTowardsTheRightShoulder) {
  const Listener rolled({}, 0, 0, kQuarterTurn_rad);
  expect_same_vector(rolled.forward(), {0, 0, -1});
  expect_same_vector(rolled.right(), {0, -1, 0});
  expect_same_vector(rolled.up(), {1, 0, 0});
}

// The angles' own formulas and the quaternion are two ways to the same axes.
TEST(Orientation, IsTheSameFromAnglesAndFromTheirQuaternion) {
  for (const double yaw : {0.0, 0.3, -2.0})
    for (const double pitch : {0.0, 0.4, -kQuarterTurn_rad})
      for (const double roll : {0.0, 0.5, -2.5}) {
        const Orientation angles(HeadAngles{yaw, pitch, roll});
        const Orientation quaternion(2.0 * angles.rotation());  // of any length
        expect_same_vector(quaternion.forward(), angles.forward(), 2e-15);
        expect_same_vector(quaternion.right(), angles.right(), 2e-15);
        expect_same_vector(quaternion.up(), angles.up(), 2e-15);
      }
}

TEST(Orientation, TurnedLeftIsOneOfMoreYaw) {
  const Orientation turned = Orientation(HeadAngles{0.3, 0.4, 0.5}).turned_left(0.7);
  const Orientation expected(HeadAngles{1.0, 0.4, 0.5});
  expect_same_vector(turned.forward(), expected.forward(), 2e-15);
  expect_same_vector(turned.right(), expected.right(), 2e-15);
}

TEST(ListenerMotion, IsTheStepPerKeyframe) {
  ListenerMotion motion(0.02);
  expect_same_vector(motion.next(Vec3(5, 0, 0)).velocity_mps, {0, 0, 0});
  expect_same_vector(motion.next(Vec3(5.02, 0, -0.04)).velocity_mps, {1, 0, -2}, 1e-12);
  expect_same_vector(motion.next(Vec3(5.02, 0, -0.04)).velocity_mps, {0, 0, 0});
}

}  // namespace
}  // namespace clamor
