// Tests that clamor impulse measures many places in one call, and with a sample of the sources.
#include <cmath>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "formats/audio/audio_file.h"
#include "tests/tools/run_clamor.h"

namespace clamor::testing {
namespace {

class ImpulseCommand : public ::testing::Test {
 protected:
  ImpulseCommand() {
    const Outcome baked = clamor({"bake", violin_room(), "-o", bake_, "--photons", "3000",
                                  "--sources", "60000", "--quiet", "--no-journal"});
    EXPECT_EQ(baked.code, 0) << baked.err;
  }

  nlohmann::json measured(std::vector<std::string> more) const {
    more.insert(more.begin(), {"impulse", bake_, "--json"});
    const Outcome outcome = clamor(more);
    EXPECT_EQ(outcome.code, 0) << outcome.err;
    return nlohmann::json::parse(outcome.out);
  }

  const Folder folder_;
  const std::string bake_ = folder_ / "room.clamor";
};

TEST_F(ImpulseCommand, MeasuresManyPlacesAsOneAfterTheOther) {
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

TEST_F(ImpulseCommand, AgreesWithAllSourcesFromASample) {
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

TEST_F(ImpulseCommand, PrintsNoProgressWhenItIsToBeQuiet) {
  const std::vector<std::string> words = {"impulse",    bake_,     "--listener", "0,1.7,2",
                                          "--listener", "2,1.5,0", "--voices",   "100"};
  EXPECT_NE(clamor(words).err.find("measured 2 listeners"), std::string::npos);
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
