#include <gmock/gmock.h>

#include "formats/gltf/gltf_marks.h"
#include "tests/formats/level_builder.h"

namespace clamor::testing {
namespace {

using ::testing::HasSubstr;

class Portals : public LevelTest {
 protected:
  // The first node has a triangle and the scale 2; the second is its child.
  void node_with(const json& second) {
    triangle();
    level_["nodes"][0]["scale"] = {2, 2, 2};
    level_["nodes"][0]["children"] = {1};
    node(second);
    level_["scenes"] = {{{"nodes", {0}}}};
  }

  std::string refusal() {
    const auto imported = import();
    EXPECT_FALSE(imported.ok());
    return imported.ok() ? "" : imported.error().message;
  }
  std::string refusal_of(const std::string& portals) {
    write("level.acoustics.json", "{\"portals\": " + portals + "}");
    return refusal();
  }
};

const json kMark = {{"clamor", {{"portal", true}}}};

void expect_near(const Vec3& a, const Vec3& b) {
  EXPECT_LT(length(a - b), 1e-6) << a.x << " " << a.y << " " << a.z;
}

TEST_F(Portals, SpanTheUnitSquareOfANodeWithoutAMesh) {
  for (const json& extras : {kMark, json{{"clamor_portal", 1}}}) {
    level_ = {{"asset", {{"version", "2.0"}}}};
    bin_.clear();
    node_with(
        {{"name", "Door"}, {"translation", {1, 2, 3}}, {"scale", {0.5, 1, 7}}, {"extras", extras}});
    const Level imported = level();
    ASSERT_EQ(imported.portals.size(), 1u);
    const Portal& portal = imported.portals[0];
    EXPECT_EQ(portal.name, "Door");
    expect_near(portal.centre_m, {2, 4, 6});
    expect_near(portal.half_u_m, {0.5, 0, 0});
    expect_near(portal.half_v_m, {0, 1, 0});
    EXPECT_EQ(imported.mesh.triangles.size(), 1u);
  }
}

TEST_F(Portals, AreTheBoundingRectanglesOfMeshesWhoseTrianglesAreNoSurfaces) {
  node_with({{"name", "Door"}, {"mesh", 0}, {"rotation", {0, 0.6, 0, 0.8}}, {"extras", kMark}});
  const Level imported = level();
  ASSERT_EQ(imported.portals.size(), 1u);
  EXPECT_EQ(imported.mesh.triangles.size(), 1u);
  const Portal& portal = imported.portals[0];
  EXPECT_GT(length(portal.half_u_m), 0.1);
  // Every corner of the triangle, which has a right angle, lies on a corner of the rectangle.
  const Vec3 u = normalize(portal.half_u_m), v = normalize(portal.half_v_m);
  EXPECT_NEAR(dot(u, v), 0, 1e-6);
}

TEST_F(Portals, WithoutAreaAreRefused) {
  node_with({{"name", "Door"}, {"scale", {1, 0, 1}}, {"extras", kMark}});
  EXPECT_THAT(refusal(), HasSubstr("'Door'"));
}

TEST_F(Portals, MustBeMarkedWithTrueOrFalse) {
  node_with({{"name", "Door"}, {"extras", {{"clamor", {{"portal", "yes"}}}}}});
  EXPECT_THAT(refusal(), HasSubstr("'portal' must be true or false"));
}

TEST_F(Portals, OfTheSidecarFaceADirection) {
  triangle();
  write("level.acoustics.json",
        R"({"portals": [{"name": "Door", "at": [5, 1, 2], "size": [0.9, 2], "facing": [3, 0, 0]},
                        {"at": [0, 0, 0], "size": [4, 2], "facing": [0, -1, 0]}]})");
  const Level imported = level();
  ASSERT_EQ(imported.portals.size(), 2u);
  const Portal &door = imported.portals[0], &hatch = imported.portals[1];
  EXPECT_EQ(door.name, "Door");
  expect_near(door.centre_m, {5, 1, 2});
  expect_near(glm::abs(door.half_u_m), {0, 0, 0.45});
  expect_near(glm::abs(door.half_v_m), {0, 1, 0});
  expect_near(glm::abs(hatch.half_u_m), {2, 0, 0});
  expect_near(glm::abs(hatch.half_v_m), {0, 0, 1});
}

TEST_F(Portals, OfTheSidecarAreCheckedMemberByMember) {
  triangle();
  EXPECT_THAT(refusal_of("{}"), HasSubstr("'portals' must be a list"));
  EXPECT_THAT(refusal_of(R"([{"at": [0,0,0], "facing": [1,0,0]}])"), HasSubstr("'size'"));
  EXPECT_THAT(refusal_of(R"([{"at": [0,0,0], "size": [1,0], "facing": [1,0,0]}])"),
              HasSubstr("portal 1: 'size'"));
  EXPECT_THAT(refusal_of(R"([{"at": [0,0,0], "size": [1,1]}])"), HasSubstr("'facing'"));
  EXPECT_THAT(refusal_of(R"([{"at": [0,0,0], "size": [1,1], "facing": [0,0,0]}])"),
              HasSubstr("'facing'"));
  EXPECT_THAT(refusal_of(R"([{"size": [1,1], "facing": [1,0,0]}])"), HasSubstr("'at'"));
  EXPECT_THAT(refusal_of(R"([{"at": [0,0,0], "size": [1,1], "facing": [1,0,0], "wide": 3}])"),
              HasSubstr("'wide'"));
}

TEST_F(Portals, AreBakedInBothStatesWhereTheLevelAsks) {
  node_with(
      {{"name", "Door"},
       {"extras", {{"clamor", {{"portal", true}, {"baked", "both"}, {"material", "glass"}}}}}});
  write("level.acoustics.json", R"({"portals": [
      {"at": [5, 1, 2], "size": [1, 2], "facing": [1, 0, 0], "baked": "both", "material": "glass"},
      {"at": [5, 1, 2], "size": [1, 2], "facing": [1, 0, 0], "baked": "open"}]})");
  const Level imported = level();
  ASSERT_EQ(imported.portals.size(), 3u);
  EXPECT_TRUE(imported.portals[0].is_baked_closed && imported.portals[1].is_baked_closed);
  EXPECT_FALSE(imported.portals[2].is_baked_closed);
  ASSERT_EQ(imported.portal_materials.size(), 3u);
  EXPECT_EQ(imported.portal_materials[0], imported.portal_materials[1]);
  EXPECT_EQ(imported.materials.at(imported.portal_materials[0]).name, "glass");
}

TEST_F(Portals, RefuseOtherStatesAndUnknownMaterials) {
  triangle();
  const std::string rest = R"("at": [0,0,0], "size": [1,1], "facing": [1,0,0])";
  EXPECT_THAT(refusal_of("[{" + rest + R"(, "baked": "closed"}])"), HasSubstr("'baked'"));
  EXPECT_THAT(refusal_of("[{" + rest + R"(, "material": "glass"}])"), HasSubstr("'material'"));
  EXPECT_THAT(refusal_of("[{" + rest + R"(, "baked": "both", "material": "glsas"}])"),
              HasSubstr("glass"));
}

// The parts of portals and the doors that they belong to.
class CoupledPortals : public Portals {
 protected:
  // A triangle of 1 m with its right angle at the origin, which is a wall, and a part of this name
  // and place with the same triangle.
  void part(const std::string& name, const json& translation, const json& rotation) {
    triangle();
    add_part(name, translation, rotation);
  }
  void add_part(const std::string& name, const json& translation, const json& rotation) {
    node({{"mesh", 0},
          {"name", name},
          {"translation", translation},
          {"rotation", rotation},
          {"extras", {{"clamor", {{"movable", true}}}}}});
  }
  // A portal around the part at (0, 0, 5), turned by nothing.
  ImportedLevel with_portal(const std::string& members) {
    write("level.acoustics.json",
          R"({"portals": [{"at": [0.5, 0.5, 5], "size": [1, 1], "facing": [0, 0, 1])" + members +
              "}]}");
    auto imported = import();
    EXPECT_TRUE(imported.ok()) << imported.error().message;
    return std::move(*imported);
  }
};

// The warnings that speak of portals.
std::vector<std::string> portal_warnings(const ImportedLevel& imported) {
  std::vector<std::string> warnings;
  for (const std::string& warning : imported.report.warnings)
    if (warning.find("portal") != std::string::npos) warnings.push_back(warning);
  return warnings;
}

using Parts = std::vector<std::uint16_t>;
const json kNoTurn = {0, 0, 0, 1}, kRightAngle = {0, std::sqrt(0.5), 0, std::sqrt(0.5)};

TEST_F(CoupledPortals, BelongToThePartThatStandsOrTurnsIntoTheirPlace) {
  for (const json& turn : {kNoTurn, kRightAngle}) {
    level_ = {{"asset", {{"version", "2.0"}}}};
    bin_.clear();
    part("Leaf", {0, 0, 5}, turn);
    add_part("Leaf elsewhere", {3, 0, 5}, turn);
    const ImportedLevel imported = with_portal("");
    EXPECT_EQ(imported.level.portals[0].parts, Parts{0});
    EXPECT_THAT(imported.report.found,
                ::testing::Contains(HasSubstr("portal '' opens and closes with 'Leaf'")));
    EXPECT_TRUE(portal_warnings(imported).empty());
  }
}

TEST_F(CoupledPortals, BelongToThePartOfTheirNameWhereverItIs) {
  part("Door", {7, 0, 5}, kNoTurn);
  add_part("Leaf", {0, 0, 9}, kNoTurn);
  EXPECT_EQ(with_portal(R"(, "name": "Door")").level.portals[0].parts, Parts{0});
}

TEST_F(CoupledPortals, BelongToThePartsThatTheLevelNames) {
  part("Leaf 1", {0, 0, 5}, kNoTurn);
  add_part("Leaf 2", {7, 0, 5}, kNoTurn);
  EXPECT_EQ(with_portal(R"(, "parts": ["*2"])").level.portals[0].parts, Parts{1});
  EXPECT_EQ(with_portal(R"(, "parts": ["leaf*"])").level.portals[0].parts, (Parts{0, 1}));
  const ImportedLevel imported = with_portal(R"(, "parts": ["Leaf 3", "Leaf 1"])");
  const auto warnings = portal_warnings(imported);
  ASSERT_EQ(warnings.size(), 1u);
  EXPECT_THAT(warnings[0], HasSubstr("the parts 'Leaf 3' of portal ''"));
}

TEST_F(CoupledPortals, AreWarnedOfWhereAPartStandsClosedInOneThatItDoesNotMove) {
  part("Leaf", {0, 0, 5}, kNoTurn);
  const ImportedLevel imported = with_portal(R"(, "name": "Gate", "parts": [])");
  EXPECT_TRUE(imported.level.portals[0].parts.empty());
  const auto warnings = portal_warnings(imported);
  ASSERT_EQ(warnings.size(), 1u);
  EXPECT_THAT(warnings[0],
              HasSubstr("'Leaf' stands closed in the portal 'Gate', which stays open"));
}

TEST_F(CoupledPortals, NameTheirPartsInTheMarksOfANode) {
  part("Leaf", {0, 0, 5}, kNoTurn);
  node({{"name", "Door"},
        {"translation", {0.5, 0.5, 5}},
        {"extras", {{"clamor", {{"portal", true}, {"parts", json::array()}}}}}});
  const Level imported = level();
  ASSERT_EQ(imported.portals.size(), 1u);
  EXPECT_TRUE(imported.portals[0].parts.empty());
}

TEST_F(Portals, AreWarnedOfWhereNoSoundCanPassThem) {
  triangle();
  const auto warnings_at = [this](const std::string& at) {
    write("level.acoustics.json",
          R"({"portals": [{"name": "Gate", "size": [1, 1], "facing": [0, 0, 1], "at": )" + at +
              "}]}");
    const auto imported = import();
    EXPECT_TRUE(imported.ok());
    return portal_warnings(*imported);
  };
  EXPECT_TRUE(warnings_at("[0.5, 0.5, 0]").empty());
  const auto warnings = warnings_at("[50, 50, 0]");
  ASSERT_EQ(warnings.size(), 1u);
  EXPECT_THAT(warnings[0], HasSubstr("'Gate' at 50,50,0 lies outside the level"));
}

TEST_F(Portals, ChangeTheInputHash) {
  triangle();
  write("level.acoustics.json",
        R"({"portals": [{"at": [5, 1, 2], "size": [0.9, 2], "facing": [3, 0, 0]}]})");
  const auto one = import();
  write("level.acoustics.json",
        R"({"portals": [{"at": [5, 1, 2], "size": [0.8, 2], "facing": [3, 0, 0]}]})");
  const auto other = import();
  ASSERT_TRUE(one.ok() && other.ok());
  EXPECT_NE(one->input_hash, other->input_hash);
}

}  // namespace
}  // namespace clamor::testing
