// Tests that clamor impulse measures many places in one call, and with a sample of the sources.
#include <cmath>
#include <filesystem>
#include <iterator>
#include <memory>
#include <tuple>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "formats/audio/audio_file.h"
#include "tests/box_level.h"
#include "tests/tools/run_clamor.h"

namespace clamor::testing {
namespace {

using ::testing::ContainsRegex;
using ::testing::HasSubstr;
using ::testing::Not;

class ImpulseCommand : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    room_ = std::make_unique<Folder>();
    bake_ = *room_ / "room.clamor";
    const Outcome baked = clamor({"bake", violin_room(), "-o", bake_, "--photons", "3000",
                                  "--sources", "30000", "--quiet", "--no-journal"});
    EXPECT_EQ(baked.code, 0) << baked.err;
  }
  static void TearDownTestSuite() { room_.reset(); }

  nlohmann::json measured(std::vector<std::string> more) const {
    more.insert(more.begin(), {"impulse", bake_, "--json"});
    const Outcome outcome = clamor(more);
    EXPECT_EQ(outcome.code, 0) << outcome.err;
    return nlohmann::json::parse(outcome.out);
  }

  const Folder folder_;
  static inline std::unique_ptr<Folder> room_;
  static inline std::string bake_;
};

TEST_F(ImpulseCommand, MeasuresManyPlacesAsOneAfterTheOther_NoAsan) {
  const std::string a = "0,1.7,2", b = "2,1.5,-1", wav = folder_ / "both.wav";
  const auto both = measured({"--listener", a, "--listener", b, "-o", wav, "--voices", "1000"});
  ASSERT_EQ(both["places"].size(), 2u);
  EXPECT_EQ(both["places"][1]["listener_m"], nlohmann::json({2, 1.5, -1}));
  for (const std::size_t place : {0, 1}) {
    const auto alone = measured({"--listener", place == 0 ? a : b, "--voices", "1000"});
    EXPECT_EQ(both["places"][place]["energy"], alone["energy"]);
    EXPECT_EQ(both["places"][place]["waveform"], alone["waveform"]);
  }
  const auto sound = read_channels(wav, 2);
  ASSERT_TRUE(sound.ok()) << sound.error().message;
  EXPECT_GT(sound->frames(), 24000u);
}

TEST_F(ImpulseCommand, WritesAFileForEachPlaceOfATableIntoAFolder) {
  const std::string table =
      folder_.write("grid.csv", "x,y,z,name\n0,1.7,2,front\n2,1.5,-1\n0,1.7,-2\n");
  const std::string wav = folder_ / "all.wav", responses = folder_ / "deep/responses";
  const Outcome outcome = clamor({"impulse", bake_, "--places", table, "--voices", "1000",
                                  "--seconds", "0.5", "--json", "-o", responses + "/"});
  ASSERT_EQ(outcome.code, 0) << outcome.err;
  EXPECT_THAT(outcome.err, ContainsRegex("3 places in [0-9.]+ s: [0-9.e+-]+ core-seconds a place"));
  const auto json = nlohmann::json::parse(outcome.out);
  ASSERT_EQ(json["places"].size(), 3u);
  const auto one_file = measured({"--listener", "0,1.7,2", "--listener", "2,1.5,-1", "--listener",
                                  "0,1.7,-2", "--voices", "1000", "--seconds", "0.5", "-o", wav});
  const auto channels = read_channels(wav, 3);
  ASSERT_TRUE(channels.ok()) << channels.error().message;
  const char* const names[] = {"front", "2", "3"};
  for (std::size_t i = 0; i < 3; ++i) {
    EXPECT_EQ(json["places"][i]["name"], names[i]);
    EXPECT_EQ(json["places"][i]["energy"], one_file["places"][i]["energy"]);
    const auto alone = read_channels(responses + "/" + names[i] + ".wav", 1);
    ASSERT_TRUE(alone.ok()) << alone.error().message;
    EXPECT_EQ(alone->channels[0], channels->channels[i]) << names[i];
  }
  EXPECT_EQ(std::distance(std::filesystem::directory_iterator(responses), {}), 3);
}

TEST_F(ImpulseCommand, WarnsOfTheFirstPlacesOutsideAndCountsTheRest) {
  std::string table;
  for (int i = 0; i < 7; ++i) table += std::to_string(100 + i) + ",1.7,3\n";
  const Outcome outcome =
      clamor({"impulse", bake_, "--places", folder_.write("far.csv", table), "--voices", "100"});
  EXPECT_EQ(outcome.code, 0) << outcome.err;
  EXPECT_THAT(outcome.err, HasSubstr("warning: 5: hardly anything is heard at 104,1.7,3"));
  EXPECT_THAT(outcome.err, Not(HasSubstr("105,1.7,3")));
  EXPECT_THAT(outcome.err, HasSubstr("2 more places have such a warning"));
}

TEST_F(ImpulseCommand, RefusesPlacesAndOutputsThatCannotBe) {
  const std::string table = folder_.write("grid.csv", "0,1.7,2,a\n0,1.7,3,a\n");
  std::string many;
  for (int i = 0; i < 1025; ++i) many += "0,1.7," + std::to_string(0.001 * i) + "\n";
  for (const auto& [more, code, says] :
       {std::tuple<std::vector<std::string>, int, std::string>{{}, 2, "--places FILE"},
        {{"--places", table}, 1, "two places have the name 'a'"},
        {{"--places", folder_ / "none.csv"}, 1, "none.csv: cannot be read"},
        {{"--places", folder_.write("many.csv", many), "-o", folder_ / "ir.wav"},
         2,
         "name a folder"},
        {{"--listener", "0,1.7,2", "-o", folder_ / "ir"}, 2, "A folder, as in responses/"},
        {{"--listener", "0,1.7,2", "-o", bake_ + "/"}, 1, "the folder cannot be made"}}) {
    std::vector<std::string> command = {"impulse", bake_};
    command.insert(command.end(), more.begin(), more.end());
    const Outcome outcome = clamor(command);
    EXPECT_EQ(outcome.code, code) << says;
    EXPECT_THAT(outcome.err, HasSubstr(says));
  }
}

TEST_F(ImpulseCommand, AgreesWithAllSourcesFromASample_NoAsan) {
  const auto all = measured({"--listener", "0,1.7,2"})["energy"],
             some = measured({"--listener", "0,1.7,2", "--voices", "8000"})["energy"];
  // 8000 sources know a level to 4.34 / sqrt(8000) = 0.05 dB, or less well by as much as their
  // weights differ.
  for (std::size_t band = 1; band < 7; ++band) {
    EXPECT_NEAR(some["g_db"][band].get<double>(), all["g_db"][band].get<double>(), 0.2) << band;
    EXPECT_NEAR(some["c80_db"][band].get<double>(), all["c80_db"][band].get<double>(), 0.2) << band;
    EXPECT_NEAR(
        10 * std::log10(some["t30_s"][band].get<double>() / all["t30_s"][band].get<double>()), 0,
        0.2)
        << band;
  }
}

// Sound in a box of diffuse walls decays as exp(-t), so that a sample which misses late sources, as
// a player's does after 0.3 s, shows in T30: it was missing in all octaves.
TEST_F(ImpulseCommand, FollowsAnExponentialDecayToItsEndByPriority_NoAsan) {
  const std::string level = box_level(folder_), bake = folder_ / "box.clamor",
                    walls = folder_.write("walls.json", R"({"materials": {"*": {
                        "absorption": 0.1, "scattering": 1}}})");
  const Outcome baked =
      clamor({"bake", level, "-o", bake, "--acoustics", walls, "--photons", "3000", "--sources",
              "30000", "--emitter", "name=a,signal=impulse,at=1,1.2,1", "--quiet", "--no-journal"});
  ASSERT_EQ(baked.code, 0) << baked.err;
  const auto energy = [&](const std::string& strategy) {
    const Outcome outcome = clamor({"impulse", bake, "--json", "--listener", "3,1.7,4",
                                    "--strategy", strategy, "--voices", "2000"});
    EXPECT_EQ(outcome.code, 0) << outcome.err;
    return nlohmann::json::parse(outcome.out)["energy"];
  };
  const auto all = energy("all"), some = energy("priority");
  for (std::size_t band = 0; band < 8; ++band) {
    ASSERT_TRUE(some["t30_s"][band].is_number()) << band;
    // Half of 2000 sources fall to 45 dB alike, 670 of them to those of T30: a slope over 30 dB
    // that is known from so many is known to some 2 %.
    EXPECT_NEAR(some["t30_s"][band].get<double>() / all["t30_s"][band].get<double>(), 1, 0.06)
        << band;
    EXPECT_NEAR(some["g_db"][band].get<double>(), all["g_db"][band].get<double>(), 0.3) << band;
  }
}

TEST_F(ImpulseCommand, PrintsNoProgressWhenItIsToBeQuiet) {
  const std::vector<std::string> words = {"impulse",    bake_,     "--listener", "0,1.7,2",
                                          "--listener", "2,1.5,0", "--voices",   "100"};
  EXPECT_NE(clamor(words).err.find("2 places in"), std::string::npos);
  std::vector<std::string> quiet = words;
  quiet.emplace_back("--quiet");
  const Outcome outcome = clamor(quiet);
  EXPECT_EQ(outcome.err, "");
  EXPECT_EQ(outcome.out, clamor(words).out);
}

TEST_F(ImpulseCommand, SaysWhichOptionAsksForASampleNow) {
  const Outcome outcome = clamor({"impulse", bake_, "--listener", "0,1.7,2", "--sources", "10"});
  EXPECT_EQ(outcome.code, 2);
  EXPECT_NE(outcome.err.find("no option '--sources'; the nearest is '--voices'"), std::string::npos)
      << outcome.err;
}

}  // namespace
}  // namespace clamor::testing
