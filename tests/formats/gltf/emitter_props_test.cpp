#include <gmock/gmock.h>

#include "tests/formats/box_level.h"

namespace clamor::testing {
namespace {

using ::testing::Contains;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

class Props : public BoxLevelTest {
 protected:
  void SetUp() override {
    BoxLevelTest::SetUp();
    write("a.wav", wav());
    level_["extensions"]["KHR_audio_emitter"] = {
        {"audio", {{{"uri", "a.wav"}}}},
        {"sources", {{{"audio", 0}}}},
        {"emitters", {{{"type", "positional"}, {"sources", {0}}}}}};
    level_["scenes"] = {{{"nodes", json::array()}}};
  }
  static json sounding(json content) {
    content["extensions"] = {{"KHR_audio_emitter", {{"emitter", 0}}}};
    return content;
  }
  void root(int node) { level_["scenes"][0]["nodes"].push_back(node); }
  void room() { root(box("Room", {-4, -1, -4}, {4, 3, 4})); }
  // The mesh of a thing of this size about the origin.
  int thing(float width, float height, float depth) {
    return box_mesh({-width / 2, -height / 2, -depth / 2}, {width / 2, height / 2, depth / 2});
  }
};

TEST_F(Props, AreNoSurfacesRoundTheSoundOfTheirNode) {
  room();
  root(node(sounding({{"name", "Radio"}, {"mesh", thing(0.3f, 0.3f, 0.3f)}})));
  EXPECT_EQ(boxes(), 1u);
  EXPECT_EQ(level().emitters.size(), 1u);
  EXPECT_THAT(import()->report.ignored,
              Contains(HasSubstr("prop 'Radio', which surrounds its emitter 'Radio'")));
  EXPECT_EQ(boxes({.kept = {"Radio"}}), 2u);
}

TEST_F(Props, MayBeTheParentOrAChildOfTheSoundAndLargerThanHalfAMetre) {
  room();
  const int engine = node(sounding({{"name", "Engine"}}));
  root(node({{"name", "Car"}, {"mesh", thing(1.8f, 1.4f, 4.5f)}, {"children", {engine}}}));
  EXPECT_EQ(boxes(), 1u);
  const int body = node({{"name", "Body"}, {"mesh", thing(0.5f, 1.8f, 0.4f)}});
  root(node(sounding({{"name", "Voice"}, {"children", {body}}})));
  EXPECT_EQ(boxes(), 1u);
}

TEST_F(Props, MayConsistOfSeveralMeshesBesideTheSound) {
  room();
  const int sound = node(sounding({{"name", "Sound"}}));
  const int left = box("Left", {-0.4f, -0.4f, -0.4f}, {0, 0.4f, 0.4f});
  const int right = box("Right", {0.0f, -0.4f, -0.4f}, {0.4f, 0.4f, 0.4f});
  root(node(
      {{"name", "Jukebox"}, {"translation", {0.1, 0, 0}}, {"children", {sound, left, right}}}));
  level_["nodes"][static_cast<std::size_t>(sound)]["translation"] = {-0.1, 0, 0};
  EXPECT_EQ(boxes(), 1u);
}

TEST_F(Props, MayStandOnTheOriginOfTheirSound) {
  room();
  root(node(sounding({{"name", "Radio"}, {"mesh", box_mesh({-1, 0, -1}, {1, 0.8f, 1})}})));
  EXPECT_EQ(boxes(), 1u);
}

TEST_F(Props, OfSoundsFromElsewhereAreSmall) {
  room();
  root(box("Cup", {0.9f, 0.9f, 0.9f}, {1.1f, 1.1f, 1.1f}));
  root(box("Cupboard", {-2, -1, -2}, {-1, 1, -1}));
  EXPECT_EQ(boxes({.emitters = {"name=a,signal=noise,at=1,1,1"}}), 2u);
  EXPECT_EQ(boxes({.emitters = {"name=b,signal=noise,at=-1.5,0,-1.5"}}), 3u);
}

TEST_F(Props, AreNotRooms) {
  const int sound = node(sounding({{"name", "Sound"}}));
  root(node({{"name", "Room"}, {"mesh", thing(8, 3, 6)}, {"children", {sound}}}));
  root(box("Garden", {-30, -2, -30}, {30, -1.9f, 30}));
  EXPECT_EQ(boxes(), 2u);
}

TEST_F(Props, AreNotCorridorsAndDucts) {
  root(node(sounding({{"name", "Duct"}, {"mesh", thing(0.5f, 0.5f, 20)}})));
  root(box("Garden", {-30, -2, -30}, {30, -1.9f, 30}));
  EXPECT_EQ(boxes(), 2u);
}

TEST_F(Props, AreNotOpen) {
  room();
  // Three sides of a box: sound leaves on the other three.
  const int mesh = thing(0.4f, 0.4f, 0.4f);
  level_["accessors"].back()["count"] = 18;
  root(node(sounding({{"name", "Shelf"}, {"mesh", mesh}})));
  EXPECT_EQ(level().mesh.triangles.size(), 12u + 6u);
}

// The whole level may be one thing, as in viewers of models; a small room has faces inwards.
TEST_F(Props, MayBeTheWholeLevel) {
  const int mesh = thing(1, 1, 1);
  root(node(sounding({{"name", "Machine"}, {"mesh", mesh}})));
  EXPECT_EQ(boxes(), 0u);
  level_["nodes"][0]["scale"] = {-1, 1, 1};
  EXPECT_EQ(boxes(), 1u) << "mirrored, its faces point inwards";
}

TEST_F(Props, KeepTheirSurfacesWhereTheSoundWasMovedAway) {
  room();
  root(node(sounding({{"name", "Radio"}, {"mesh", thing(0.3f, 0.3f, 0.3f)}})));
  write("level.acoustics.json", R"({"emitters": [{"name": "Radio", "at": [2, 1, 0]}]})");
  EXPECT_EQ(boxes(), 2u);
}

}  // namespace
}  // namespace clamor::testing
