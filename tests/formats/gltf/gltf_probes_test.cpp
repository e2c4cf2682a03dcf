#include "formats/gltf/gltf_marks.h"

#include <gmock/gmock.h>

#include "tests/formats/level_builder.h"

namespace clamor::testing {
namespace {

using ::testing::Contains;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::Not;

class Probes : public LevelTest {
 protected:
  // A node at (1, 2, 3) in a parent that is scaled by two.
  void node_with(const json& extras) {
    triangle();
    level_["nodes"][0]["scale"] = {2, 2, 2};
    level_["nodes"][0]["children"] = {1};
    node({{"name", "Spot"}, {"translation", {1, 2, 3}}, {"extras", extras}});
    level_["scenes"] = {{{"nodes", {0}}}};
  }

  std::string refusal_of(const std::string& probes) {
    write("level.acoustics.json", "{\"probes\": " + probes + "}");
    const auto imported = import();
    EXPECT_FALSE(imported.ok()) << probes;
    return imported.ok() ? "" : imported.error().message;
  }
};

TEST_F(Probes, AreNodesThatExtrasMark) {
  node_with({{"clamor", {{"probe", true}}}});
  EXPECT_THAT(level().probes_m, ElementsAre(Vec3(2, 4, 6)));
}

TEST_F(Probes, AreNodesWithAFlatCustomProperty) {
  for (const json& value : {json(true), json(1)}) {
    level_ = {{"asset", {{"version", "2.0"}}}};
    bin_.clear();
    node_with({{"clamor_probe", value}, {"something_else", 5}});
    EXPECT_THAT(level().probes_m, ElementsAre(Vec3(2, 4, 6)));
  }
}

TEST_F(Probes, AreNotNodesWithOtherExtras) {
  for (const json& extras : {json{{"clamor", {{"probe", false}}}}, json{{"probe", true}},
                             json{{"clamor_probe", 0}}, json("clamor"), json(7)}) {
    level_ = {{"asset", {{"version", "2.0"}}}};
    bin_.clear();
    node_with(extras);
    EXPECT_THAT(level().probes_m, ElementsAre()) << extras;
  }
}

TEST_F(Probes, OfTheSidecarFollowThoseOfTheScene) {
  node_with({{"clamor", {{"probe", true}}}});
  write("level.acoustics.json",
        R"({"probes": [{"at": [1, 1.5, -3], "comment": "by the door"}, {"at": [0, 0, 0]}]})");
  const auto imported = import();
  ASSERT_TRUE(imported.ok()) << imported.error().message;
  EXPECT_THAT(imported->level.probes_m,
              ElementsAre(Vec3(2, 4, 6), Vec3(1, 1.5, -3), Vec3(0, 0, 0)));
  EXPECT_THAT(imported->report.found, Contains("3 probes placed by hand"));
  EXPECT_THAT(imported->report.warnings, Not(Contains(HasSubstr("makes a sound"))));
}

TEST_F(Probes, DetermineTheHash) {
  triangle();
  const auto without = import()->input_hash;
  write("level.acoustics.json", R"({"probes": [{"at": [1, 1, 1]}]})");
  EXPECT_NE(import()->input_hash, without);
}

TEST_F(Probes, OfTheSidecarAreRefusedWithAReason) {
  triangle();
  EXPECT_THAT(refusal_of("7"), HasSubstr("'probes' must be a list"));
  EXPECT_THAT(refusal_of("[[1, 2, 3]]"), HasSubstr("probe 1"));
  EXPECT_THAT(refusal_of("[{}]"), HasSubstr("probe 1: 'at' is missing"));
  EXPECT_THAT(refusal_of("[{\"at\": [1, 2, 3]}, {\"at\": [1, 2]}]"), HasSubstr("probe 2: 'at'"));
  EXPECT_THAT(refusal_of("[{\"at\": [1, 2, 1e9]}]"), HasSubstr("'at' must be three numbers"));
  EXPECT_THAT(refusal_of("[{\"att\": [1, 2, 3]}]"), HasSubstr("'at'"));
}

}  // namespace
}  // namespace clamor::testing
