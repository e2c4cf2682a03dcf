#include <set>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "formats/bake_file/bake_writer.h"
#include "tests/baked_room.h"
#include "tests/build_paths.h"
#include "tests/tools/run_clamor.h"

namespace clamor {
namespace {

using testing::clamor;
using testing::Folder;

void bake_room(const std::string& output, std::vector<std::string> more,
               const std::string& photons = "500", const std::string& sources = "2000") {
  std::vector<std::string> words = {
      "bake",         std::string(testing::kSourceDir) + "/assets/levels/violin_room.glb",
      "-o",           output,
      "--no-journal", "--photons",
      photons,        "--sources",
      sources};
  words.insert(words.end(), more.begin(), more.end());
  const auto outcome = clamor(words);
  ASSERT_EQ(outcome.code, 0) << outcome.err;
}

TEST(DiffCommand, SaysInWhatTwoBakesDifferAndInNothingElse) {
  const Folder folder;
  const std::string a = folder / "a.clamor", b = folder / "b.clamor", c = folder / "c.clamor";
  bake_room(a, {});
  bake_room(b, {});
  bake_room(c, {"--seed", "2", "--emitter", "name=bell,signal=impulse,at=0,1,0"});

  const auto same = clamor({"diff", a, b});
  EXPECT_EQ(same.code, 0);
  EXPECT_NE(same.out.find("sound the same"), std::string::npos) << same.out;

  const auto other = clamor({"diff", a, c, "--json"});
  ASSERT_EQ(other.code, 1) << other.err;
  const auto json = nlohmann::json::parse(other.out);
  EXPECT_FALSE(json["same"]);
  std::set<std::string> what;
  for (const auto& row : json["differences"]) what.insert(row["what"]);
  EXPECT_TRUE(what.contains("seed") && what.contains("emitters in one file only") &&
              what.contains("bytes"));
  EXPECT_FALSE(what.contains("kappa") || what.contains("level") || what.contains("tool"));
  for (const auto& row : json["differences"])
    if (row["what"] == "seed") {
      EXPECT_EQ(row["a"], "1");
      EXPECT_EQ(row["b"], "2");
    }
  // A second emitter of gain 1 beside a directional one.
  for (const double level_difference_db : json["level_db"]) EXPECT_GT(level_difference_db, 1);
  EXPECT_NE(clamor({"diff", a, c}).out.find("B - A, dB"), std::string::npos);
}

TEST(DiffCommand, FindsThatABakeInTwoVersionsOfTheFormatSoundsTheSame) {
  const std::string golden = std::string(testing::kSourceDir) + "/tests/formats/golden/";
  const auto outcome = clamor({"diff", golden + "3.0.clamor", golden + "3.1.clamor", "--json"});
  EXPECT_EQ(outcome.code, 0) << outcome.err;
  const auto json = nlohmann::json::parse(outcome.out);
  EXPECT_TRUE(json["same"]);
  std::set<std::string> what;
  for (const auto& row : json["differences"]) what.insert(row["what"]);
  EXPECT_TRUE(what.contains("format")) << json;
}

TEST(DiffCommand, TellsWhichValueOfAnEmitterOrAMaterialChangedAndByHowMuchItIsLouder) {
  const Folder folder;
  const std::string level = folder.write("level.gltf", testing::kEmptyLevel);
  const auto bake_with = [&](const std::string& name, const std::string& gain) {
    const auto outcome = clamor({"bake", level, "-o", folder / name, "--no-journal", "--emitter",
                                 "name=bell,signal=impulse,at=0,1,0,gain=" + gain, "--emitter",
                                 "name=horn,signal=impulse,at=0,1,0,gain=-100dB"});
    ASSERT_EQ(outcome.code, 0) << outcome.err;
  };
  bake_with("a.clamor", "0dB");
  bake_with("b.clamor", "6dB");
  const auto outcome = clamor({"diff", folder / "a.clamor", folder / "b.clamor", "--json"});
  EXPECT_EQ(outcome.code, 1) << outcome.err;
  const auto json = nlohmann::json::parse(outcome.out);
  ASSERT_EQ(json["differences"].size(), 1u) << outcome.out;
  EXPECT_EQ(json["differences"][0]["what"], "emitter 'bell' gain");
  EXPECT_EQ(json["differences"][0]["a"], "1.000");
  EXPECT_EQ(json["differences"][0]["b"], "1.995");
  for (const double level_difference_db : json["level_db"])
    EXPECT_NEAR(level_difference_db, 6, 1e-3);
}

TEST(DiffCommand, HearsWhatTheFilesDoNotTell) {
  // One source of the bake has the other polarity.
  const Folder folder;
  const std::string a = folder / "a.clamor", b = folder / "b.clamor";
  BakeContents contents = testing::baked_contents(100);
  ASSERT_TRUE(write_bake(a, contents, 1).ok());
  contents.octree.sources.back().polarity =
      static_cast<std::int8_t>(-contents.octree.sources.back().polarity);
  ASSERT_TRUE(write_bake(b, contents, 1).ok());
  const auto outcome = clamor({"diff", a, b});
  EXPECT_EQ(outcome.code, 1) << outcome.err;
  EXPECT_NE(outcome.out.find("They differ, but sound alike"), std::string::npos) << outcome.out;
}

TEST(DiffCommand, TellsADifferenceOfASeedFromOneThatIsHeard_NoAsan) {
  const Folder folder;
  const std::string a = folder / "a.clamor", b = folder / "b.clamor", c = folder / "c.clamor";
  bake_room(a, {}, "3000", "100000");
  bake_room(b, {"--seed", "2"}, "3000", "100000");
  const std::string bright = folder.write("bright.json", R"({"materials": {"curtains": "metal"}})");
  bake_room(c, {"--acoustics", bright}, "3000", "100000");
  const auto verdict = [&](const std::string& other) {
    const auto outcome = clamor({"diff", a, other, "--json"});
    EXPECT_EQ(outcome.code, 1) << outcome.err;
    return nlohmann::json::parse(outcome.out);
  };
  const auto of_seed = verdict(b), of_material = verdict(c);
  EXPECT_NE(of_seed["audible"], "yes") << of_seed["verdict"];
  const std::string sentence = of_seed["verdict"];
  EXPECT_EQ(sentence.find("do not sound the same"), std::string::npos) << sentence;
  EXPECT_EQ(of_material["audible"], "yes") << of_material["verdict"];
}

TEST(DiffCommand, NamesTheFileThatCannotBeRead) {
  const Folder folder;
  const std::string a = folder / "a.clamor";
  bake_room(a, {});
  const auto outcome = clamor({"diff", a, folder / "none.clamor"});
  EXPECT_EQ(outcome.code, 3);
  EXPECT_NE(outcome.err.find("none.clamor"), std::string::npos);
}

}  // namespace
}  // namespace clamor
