// Tests that inspect says of each rule what it would leave out of a level, without baking it.
#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "tests/formats/box_level.h"
#include "tests/tools/run_clamor.h"

namespace clamor::testing {
namespace {

// A room with one thing for each rule.
class LevelInspection : public BoxLevelTest {
 protected:
  void SetUp() override {
    BoxLevelTest::SetUp();
    const int white = material({{"name", "plaster"}});
    box("Room", {0, 0, 0}, {8, 3, 6}, white);
    for (const char* name : {"Draft_noimp", "UCX_Room", "UBX_Room", "Floor_navmesh", "Exit_trigger",
                             "Wall_occonly", "Room_LOD1", "Skydome"})
      box(name, {1, 1, 1}, {2, 2, 2}, white);
    box("Hidden", {1, 1, 1}, {2, 2, 2}, white);
    level_["nodes"].back()["extras"] = {{"visible", false}};
    box("Pane", {3, 1, 1}, {3.1f, 2, 2},
        material({{"name", "air"},
                  {"alphaMode", "BLEND"},
                  {"pbrMetallicRoughness", {{"baseColorFactor", {1, 1, 1, 0}}}}}));
    box("Radio", {4.9f, 0.9f, 2.9f}, {5.1f, 1.1f, 3.1f}, white);
    write("level.acoustics.json", R"({"emitters": [{"signal": "noise", "at": [5, 1, 3]}]})");
    path_ = write("level.gltf", finished().dump());
  }

  std::string shown(std::vector<std::string> more = {}) const {
    more.insert(more.begin(), {"inspect", path_});
    const Outcome outcome = clamor(more);
    EXPECT_EQ(outcome.code, 0) << outcome.err;
    return outcome.out;
  }
  // How much each rule left out.
  std::map<std::string, int> counts(std::vector<std::string> more = {}) const {
    more.push_back("--json");
    std::map<std::string, int> counts;
    const json printed = json::parse(shown(more));
    for (const json& rule : printed["rules"]) {
      EXPECT_FALSE(rule["applies_to"].get<std::string>().empty()) << rule;
      counts[rule["reason"]] = rule["left_out"];
    }
    return counts;
  }

  std::string path_;
};

TEST_F(LevelInspection, CountsWhatEachRuleLeavesOut) {
  const std::map<std::string, int> expected = {{"mesh to be ignored", 1},
                                               {"hidden mesh", 1},
                                               {"collision hull", 2},
                                               {"navigation mesh", 1},
                                               {"trigger volume", 1},
                                               {"occluder for rendering", 1},
                                               {"lower level of detail", 1},
                                               {"sky", 1},
                                               {"fully transparent material", 1},
                                               {"prop of an emitter", 1}};
  EXPECT_EQ(counts(), expected);
  auto changed = expected;
  changed["collision hull"] = 1;
  changed["mesh to be ignored"] = 2;
  EXPECT_EQ(counts({"--keep", "UCX_*", "--ignore", "Room"}), changed);
}

TEST_F(LevelInspection, PrintsEachRuleWithWhatItAppliesToAndBakesNothing) {
  const std::string text = shown();
  EXPECT_NE(text.find("rule     collision hull             2 left out ubx_*"), std::string::npos)
      << text;
  EXPECT_NE(text.find("'UCX_Room'"), std::string::npos) << text;
  EXPECT_NE(text.find("'Radio'"), std::string::npos) << text;
  EXPECT_EQ(std::distance(std::filesystem::directory_iterator(folder_), {}), 2)
      << "the level and its sidecar";
}

}  // namespace
}  // namespace clamor::testing
