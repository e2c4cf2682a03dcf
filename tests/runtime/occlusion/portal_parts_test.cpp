// portal_parts_test.cpp: how far doors close the portals that they belong to.
#include "runtime/occlusion/portal_parts.h"

#include <cmath>
#include <numbers>
#include <vector>

#include <gtest/gtest.h>

#include "runtime/occlusion/part_shape.h"
#include "tests/box_mesh.h"

namespace clamor {
namespace {

// A wall across x = 6 m, 5 m wide and 2.7 m high, with a doorway of 0.9 x 2 m.
Mesh wall() {
  Mesh mesh;
  const auto piece = [&mesh](double low_y, double high_y, double low_z, double high_z) {
    testing::add_quad(mesh, {Vec3f(6, low_y, low_z), Vec3f(6, high_y, low_z),
                             Vec3f(6, high_y, high_z), Vec3f(6, low_y, high_z)});
  };
  piece(0, 2.7, 0, 2.05);
  piece(0, 2.7, 2.95, 5);
  piece(2, 2.7, 2.05, 2.95);
  return mesh;
}

// The doorway with a door of its size, 4 cm thick, whose pivot is the hinge.
class DoorwayOfAPortal {
 public:
  explicit DoorwayOfAPortal(const Material& material = {}) : geometry_(wall(), materials_) {
    Mesh leaf = box_mesh({0.02, 1, 0.45}, 0);
    for (Vec3f& vertex : leaf.vertices_m) vertex += Vec3f(0, 0, 0.45f);
    const auto shape = PartShape::make(leaf, std::span(&material, 1));
    handle_ = *parts_.add(*shape, kClosed);
    geometry_.set_parts(&scene_);
    Portal portal{"Door", {6, 1, 2.5}, {0, 0, 0.45}, {0, 1, 0}};
    portal.parts = {0};
    portals_ = PortalParts(std::span(&portal, 1), std::span(&handle_, 1));
  }

  double openness(const PartPose& pose, bool enabled = true) {
    EXPECT_TRUE(parts_.move(handle_, pose).ok());
    EXPECT_TRUE(parts_.enable(handle_, enabled).ok());
    scene_.update(parts_);
    has_changed_ = portals_.update(geometry_, scene_);
    return static_cast<double>(portals_.openness()[0]);
  }
  double turned(double open_deg) {
    const double half_rad = open_deg / 2 * std::numbers::pi / 180;
    return openness({kClosed.position_m, Rotation(static_cast<float>(std::cos(half_rad)), 0,
                                                  static_cast<float>(std::sin(half_rad)), 0)});
  }
  double moved(const Vec3& by_m) { return openness({kClosed.position_m + by_m}); }
  bool has_changed() const { return has_changed_; }

  static constexpr PartPose kClosed{{6, 1, 2.05}};

 private:
  const std::vector<Material> materials_ = {testing::uniform_material(0.2f)};
  OcclusionGeometry geometry_;
  MovingParts parts_;
  PartScene scene_;
  PartHandle handle_;
  PortalParts portals_;
  bool has_changed_ = false;
};

TEST(PortalParts, CloseTheirPortalAndOpenIt) {
  DoorwayOfAPortal doorway;
  EXPECT_EQ(doorway.turned(0), 0);
  EXPECT_GT(doorway.turned(90), 0.95);
  EXPECT_EQ(doorway.openness(DoorwayOfAPortal::kClosed, false), 1) << "disabled";
  EXPECT_EQ(doorway.moved({0, 0, 3}), 1);
  EXPECT_LT(doorway.moved({0.15, 0, 0}), 0.6) << "a gap of 15 cm all around";
}

// Closed form: a leaf in the plane of the portal covers a share of it. The tolerance is for its 4
// cm and the 128 lines.
TEST(PortalParts, OpenAsFarAsASlidingLeafUncovers) {
  DoorwayOfAPortal doorway;
  for (const double share : {0.1, 0.25, 0.5, 0.75}) {
    EXPECT_NEAR(doorway.moved({0, 0, share * 0.9}), share, 0.08);
    EXPECT_NEAR(doorway.moved({0, share * 2, 0}), share, 0.08) << "lifted";
  }
}

// The gap between the leaf and the frame is 2 sin(a / 2) times as wide as the door, and a mirror
// throws a part of what it meets on.
TEST(PortalParts, OpenByAboutTheGapOfALeafThatTurns) {
  DoorwayOfAPortal doorway;
  double last = 0;
  for (const double open_deg : {5.0, 10.0, 20.0, 30.0, 45.0, 60.0, 75.0, 90.0}) {
    const double gap = std::min(1.0, 2 * std::sin(open_deg / 2 * std::numbers::pi / 180));
    const double openness = doorway.turned(open_deg), other = doorway.turned(-open_deg);
    EXPECT_NEAR(openness, other, 0.08) << open_deg << " degrees, to either side";
    EXPECT_LE(openness, gap + 0.05) << open_deg;
    EXPECT_GE(openness, gap / 2 - 0.05) << open_deg;
    EXPECT_GE(openness, last - 0.01) << open_deg;
    last = openness;
  }
}

// Each path through the box passes two surfaces.
TEST(PortalParts, LetThroughWhatTheyTransmit) {
  Material material;
  for (std::size_t b = 0; b < kBandCount; ++b)
    material.absorption[b] = material.transmission[b] = b % 2 == 0 ? 0.1f : 0.001f;
  EXPECT_NEAR(DoorwayOfAPortal(material).turned(0), 1e-4, 1e-6) << "the mean in decibels";
}

TEST(PortalParts, TellWhetherTheyChangedAnything) {
  DoorwayOfAPortal doorway;
  (void)doorway.turned(0);
  EXPECT_TRUE(doorway.has_changed());
  (void)doorway.turned(40);
  EXPECT_TRUE(doorway.has_changed());
  (void)doorway.turned(40);
  EXPECT_FALSE(doorway.has_changed());
}

}  // namespace
}  // namespace clamor
