#include "formats/gltf/gltf_groups.h"

#include <gtest/gtest.h>

#include "tests/formats/level_builder.h"

namespace clamor {
namespace {

using testing::json;
using testing::wav;

// Two stands of two blocks; a block has a drum and an instanced node with three fans.
class GltfGroups : public testing::LevelTest {
 protected:
  void SetUp() override {
    LevelTest::SetUp();
    write("song.wav", wav());
    level_["extensions"]["KHR_audio_emitter"] = {
        {"audio", {{{"uri", "song.wav"}}}},
        {"sources", {{{"audio", 0}, {"loop", true}}}},
        {"emitters", {{{"type", "positional"}, {"sources", {0}}}}}};
    const int places = floats({0, 0, 0, 1, 0, 0, 2, 0, 0});
    delays_ = floats({0.25f, 0, 0.5f}, "SCALAR", 1);
    const auto add = [&](json more, const std::string& name, std::vector<int> children) {
      more["name"] = name;
      if (!children.empty()) more["children"] = children;
      return node(more);
    };
    const json plays = {{"extensions", {{"KHR_audio_emitter", {{"emitters", {0}}}}}}};
    const auto block = [&](double x) {
      json fans = plays;
      fans["extensions"]["EXT_mesh_gpu_instancing"]["attributes"] = {{"TRANSLATION", places},
                                                                     {"_DELAY_S", delays_}};
      const int drum = add(plays, "drum " + std::to_string(next_), {});
      const int fan = add(fans, "fan", {});
      ++next_;
      return add({{"translation", {x, 0, 0}}}, "block", {drum, fan});
    };
    const auto stand = [&](double z) {
      const int first = block(0), second = block(10);
      return add({{"translation", {0, 0, z}}}, "stand", {first, second});
    };
    const int first = stand(0), second = stand(20);
    const int crowd = add({}, "crowd", {first, second});
    level_["scene"] = 0;
    level_["scenes"] = {{{"nodes", {crowd}}}};
  }

  int delays_ = 0, next_ = 0;
};

std::vector<std::pair<std::size_t, std::size_t>> ranges(const SceneGroups& groups) {
  std::vector<std::pair<std::size_t, std::size_t>> result;
  for (const SceneGroup& group : groups) result.emplace_back(group.first, group.end);
  return result;
}

using Ranges = std::vector<std::pair<std::size_t, std::size_t>>;

TEST_F(GltfGroups, AreTheSubtreesOfTheSceneInnerOnesFirst) {
  const auto imported = import();
  ASSERT_TRUE(imported.ok()) << imported.error().message;
  ASSERT_EQ(imported->level.emitters.size(), 16u);
  EXPECT_EQ(ranges(imported->groups), (Ranges{{1, 4},
                                              {0, 4},
                                              {5, 8},
                                              {4, 8},
                                              {0, 8},
                                              {9, 12},
                                              {8, 12},
                                              {13, 16},
                                              {12, 16},
                                              {8, 16},
                                              {0, 16}}));
  // The second block of the second stand is congruent to the first block of the first.
  const SceneGroup &first = imported->groups[1], &last = imported->groups[8];
  for (std::size_t i = 0; i < 4; ++i) {
    const auto local = [&](const SceneGroup& group) {
      const Vec3 at = imported->level.emitters[group.first + i].position_m;
      return glm::inverse(group.axes) * (at - group.origin_m);
    };
    EXPECT_LT(length(local(first) - local(last)), 1e-9);
  }
}

TEST_F(GltfGroups, DropEmittersThatTheCommandLineReplaces) {
  ImportOptions options;
  options.emitters = {"name=drum 2,signal=noise,at=0,1,0"};
  const auto imported = import(options);
  ASSERT_TRUE(imported.ok()) << imported.error().message;
  ASSERT_EQ(imported->level.emitters.size(), 16u);  // the new emitter is in no group
  EXPECT_EQ(imported->level.emitters[15].name, "drum 2");
  EXPECT_EQ(
      ranges(imported->groups),
      (Ranges{
          {1, 4}, {0, 4}, {5, 8}, {4, 8}, {0, 8}, {8, 11}, {12, 15}, {11, 15}, {8, 15}, {0, 15}}));
}

TEST_F(GltfGroups, InstancesStartAtTheTimeOfTheirAttribute) {
  const auto imported = import();
  ASSERT_TRUE(imported.ok()) << imported.error().message;
  EXPECT_EQ(imported->level.emitters[0].delay_s, 0);
  EXPECT_EQ(imported->level.emitters[1].delay_s, 0.25);
  EXPECT_EQ(imported->level.emitters[2].delay_s, 0);
  EXPECT_EQ(imported->level.emitters[3].delay_s, 0.5);
}

TEST_F(GltfGroups, ANegativeStartIsRejected) {
  level_["nodes"][1]["extensions"]["EXT_mesh_gpu_instancing"]["attributes"]["_DELAY_S"] =
      floats({0, -1, 0}, "SCALAR", 1);
  EXPECT_NE(refusal().find("_DELAY_S"), std::string::npos) << refusal();
  level_["nodes"][1]["extensions"]["EXT_mesh_gpu_instancing"]["attributes"]["_DELAY_S"] =
      floats({0, 1}, "SCALAR", 1);
  EXPECT_NE(refusal().find("_DELAY_S"), std::string::npos) << refusal();
}

}  // namespace
}  // namespace clamor
