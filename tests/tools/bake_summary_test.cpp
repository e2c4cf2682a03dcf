#include "tools/bake_summary.h"

#include <nlohmann/json.hpp>

#include "tests/build_paths.h"
#include "tests/rooms.h"
#include "tests/tools/program.h"

namespace clamor {
namespace {

using testing::clamor;
using testing::Folder;

TEST(BakeSummary, TellsTheDecayTimeOfARoom) {
  Level level = testing::shoebox({5, 4, 3}, testing::uniform_material(0.2f), {1.3, 1.7, 1.1});
  level.air.humidity_percent = 90;  // little loss at low frequencies
  const auto contents = bake(level, {.settings = {.sources = 100000}});
  ASSERT_TRUE(contents.ok());
  const DecaySummary& decay = contents->statistics.decay;
  EXPECT_EQ(decay.places, 4u);
  // Exact for Lambertian walls without air, from the integral equation: 0.481 s. Air takes 0.3 % at
  // 125 Hz; a place's T30 from 100 000 sources varies by 1 %.
  EXPECT_NEAR(decay.t30_s[1] / 0.481, 1, 0.02);
}

TEST(BakeSummary, SaysNothingOfDecaysWhereThereAreNone) {
  Level level = testing::shoebox({5, 4, 3}, testing::uniform_material(1), {1.3, 1.7, 1.1});
  const auto dry = bake(level, {.settings = {.photons = 1000}});
  ASSERT_TRUE(dry.ok());
  for (const float t30_s : dry->statistics.decay.t30_s) EXPECT_EQ(t30_s, 0);
  level.mesh = {};
  const auto field = bake(level, {.settings = {.photons = 1000}});
  ASSERT_TRUE(field.ok());
  EXPECT_EQ(field->statistics.decay.places, 0u);
}

TEST(BakeCommand, SaysWhatTheLevelIsAndWhatSimplifyingDidToIt) {
  const Folder folder;
  const auto bake = [&](std::vector<std::string> more) {
    std::vector<std::string> words = {
        "bake",        std::string(testing::kSourceDir) + "/assets/levels/violin_room.glb",
        "-o",          folder / "out.clamor",
        "--photons",   "1000",
        "--sources",   "1000",
        "--no-journal"};
    words.insert(words.end(), more.begin(), more.end());
    return clamor(words);
  };
  const auto plain = bake({});
  EXPECT_NE(plain.err.find("closed: none of "), std::string::npos) << plain.err;
  EXPECT_EQ(plain.err.find("simplified"), std::string::npos) << plain.err;
  const auto simple = bake({"--simplify", "0.05"});
  ASSERT_EQ(simple.code, 0) << simple.err;
  EXPECT_NE(simple.err.find("simplified within 5 cm: "), std::string::npos) << simple.err;
  EXPECT_NE(simple.err.find(" triangles instead of 5952, area "), std::string::npos) << simple.err;
  const auto shown = clamor({"inspect", folder / "out.clamor"});
  EXPECT_NE(shown.out.find("--simplify 0.05"), std::string::npos) << shown.out;
  for (const char* wrong : {"-1", "11", "a"}) EXPECT_EQ(bake({"--simplify", wrong}).code, 2);
}

TEST(BakeCommand, ThatEndedAtAnErrorIsMadeAgainByTheCommandThatInspectPrints) {
  const Folder folder;
  const std::string level = std::string(testing::kSourceDir) + "/assets/levels/violin_room.glb";
  const std::string once = folder / "once.clamor", again = folder / "again.clamor";
  const auto outcome = clamor({"bake", level, "-o", once, "--until", "1dB"});
  ASSERT_EQ(outcome.code, 0) << outcome.err;
  EXPECT_EQ(outcome.err.find("warning"), std::string::npos) << outcome.err;
  const auto shown = clamor({"inspect", once});
  const std::size_t place = shown.out.find("clamor bake violin_room.glb -o once.clamor ");
  ASSERT_NE(place, std::string::npos) << shown.out;
  std::istringstream words(shown.out.substr(place, shown.out.find('\n', place) - place));
  std::vector<std::string> command;
  for (std::string word; words >> word;) command.push_back(word);
  ASSERT_EQ(command.size(), 9u);
  command.erase(command.begin());
  command[1] = level;
  command[3] = again;
  const auto second = clamor(command);
  ASSERT_EQ(second.code, 0) << second.err;
  EXPECT_TRUE(testing::read(once) == testing::read(again));
  for (const char* wrong : {"0.5", "0dB", "x"})
    EXPECT_EQ(clamor({"bake", level, "-o", once, "--until", wrong}).code, 2);
  EXPECT_EQ(clamor({"bake", level, "-o", once, "--until", "1dB", "--photons", "100"}).code, 2);
}

TEST(BakeCommand, ReportsProgressAsJsonLinesForBuildSystems) {
  const Folder folder;
  const auto outcome = clamor(
      {"bake", std::string(testing::kSourceDir) + "/assets/levels/violin_room.glb", "-o",
       folder / "out.clamor", "--photons", "100000", "--sources", "5000", "--progress", "json"});
  ASSERT_EQ(outcome.code, 0) << outcome.err;
  std::istringstream lines(outcome.err);
  std::string line, last;
  std::uint64_t photons = 0;
  while (std::getline(lines, line)) {
    const auto json = nlohmann::json::parse(line);
    if (json["stage"] == "level") {
      EXPECT_EQ(json["triangles"], 5952);
      EXPECT_EQ(json["escaped_power_share"], 0);
      continue;
    }
    EXPECT_GE(json["photons"].get<std::uint64_t>(), photons);
    photons = json["photons"];
    last = json["stage"];
    if (last == "done") {
      EXPECT_GT(json["error_db"].get<double>(), 0.1);
      EXPECT_LT(json["error_db"].get<double>(), 3);
    }
  }
  EXPECT_EQ(last, "done");
  EXPECT_EQ(photons, 100000u);
  EXPECT_EQ(clamor({"bake", "x.glb", "-o", folder / "y", "--progress", "xml"}).code, 2);
}

TEST(MaterialsCommand, ListsEveryPresetWithItsFiguresAndTheirSource) {
  const auto json = testing::clamor({"materials", "--json"});
  ASSERT_EQ(json.code, 0);
  const auto list = nlohmann::json::parse(json.out);
  const auto table = testing::clamor({"materials"}).out;
  EXPECT_EQ(list.size(), 25u);
  for (const auto& preset : list) {
    EXPECT_EQ(preset["absorption"].size(), 8u);
    EXPECT_FALSE(preset["source"].get<std::string>().empty());
    EXPECT_NE(table.find("\n" + preset["name"].get<std::string>() + " "), std::string::npos);
  }
  EXPECT_EQ(testing::clamor({"materials", "--name", "velvet"}).out, "velvet -> curtain\n");
}

}  // namespace
}  // namespace clamor
