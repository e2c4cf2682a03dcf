#include "formats/gltf/gltf_sounds.h"

#include <gmock/gmock.h>

#include "formats/gltf/khr_audio.h"
#include "tests/formats/level_builder.h"

namespace clamor::testing {
namespace {

using ::testing::Contains;
using ::testing::HasSubstr;
using ::testing::Not;

class Sounds : public LevelTest {
 protected:
  // A KHR emitter with one source on a node that looks along +X at (1, 2, 3).
  void khr(json emitter = json::object()) {
    write("tone.wav", wav());
    emitter["sources"] = {0};
    emitter["type"] = "positional";
    level_["extensions"]["KHR_audio_emitter"] = {
        {"audio", {{{"uri", "tone.wav"}}}},
        {"sources", {{{"audio", 0}, {"gain", 0.5}, {"loop", true}}}},
        {"emitters", {emitter}}};
    const double half = std::sqrt(0.5);
    node({{"name", "Radio"},
          {"translation", {1, 2, 3}},
          {"rotation", {0, -half, 0, half}},
          {"extensions", {{"KHR_audio_emitter", {{"emitters", {0}}}}}}});
  }
};

TEST_F(Sounds, HaveThePositionAndMinusZAxisOfTheirNode) {
  khr({{"gain", 0.5}, {"positional", {{"refDistance", 2}}}});
  const Level result = level();
  ASSERT_EQ(result.emitters.size(), 1u);
  const Emitter& emitter = result.emitters[0];
  EXPECT_EQ(emitter.name, "Radio");
  EXPECT_LT(length(emitter.position_m - Vec3(1, 2, 3)), 1e-9);
  EXPECT_LT(length(emitter.axis - Vec3(1, 0, 0)), 1e-9);
  EXPECT_DOUBLE_EQ(emitter.gain, 0.5 * 0.5 * 2);
  EXPECT_TRUE(result.signals.at(0).loop);
  EXPECT_EQ(result.signals.at(0).samples.size(), 24000u);
}

TEST_F(Sounds, OfSeveralChannelsAreDownmixedAndReported) {
  khr();
  EXPECT_THAT(import()->report.ignored, Not(Contains(HasSubstr("channels"))));
  std::string stereo = wav();
  stereo[22] = 2;  // channels
  stereo[32] = 4;  // bytes a frame
  write("tone.wav", stereo);
  const auto of_level = import();
  ASSERT_TRUE(of_level.ok());
  EXPECT_EQ(of_level->level.signals.at(0).samples.size(), 12000u);
  EXPECT_THAT(of_level->report.ignored,
              Contains(HasSubstr("all but the mean of the 2 channels of 'tone.wav'")));
  const auto added = import({.emitters = {"name=Radio,at=0,0,0,signal=" + folder_ + "/tone.wav"}});
  ASSERT_TRUE(added.ok());
  EXPECT_THAT(added->report.ignored, Contains(HasSubstr("2 channels of '" + folder_)));
}

TEST_F(Sounds, AreReadInTheOldSpelling) {
  khr();
  level_["nodes"][0]["extensions"]["KHR_audio_emitter"] = {{"emitter", 0}};
  level_["extensions"]["KHR_audio_emitter"]["sources"][0]["autoPlay"] = true;
  EXPECT_EQ(level().emitters.size(), 1u);
}

// The form of Khronos' sample AudioSimple.
TEST_F(Sounds, AreReadFromKhrAudio) {
  khr({{"gain", 0.5}});
  level_["extensions"] = {{"KHR_audio", level_["extensions"]["KHR_audio_emitter"]}};
  level_["nodes"][0]["extensions"] = {{"KHR_audio", {{"emitter", 0}}}};
  level_["extensionsRequired"] = {"KHR_audio"};
  const auto imported = import();
  ASSERT_TRUE(imported.ok()) << imported.error().message;
  ASSERT_EQ(imported->level.emitters.size(), 1u);
  EXPECT_DOUBLE_EQ(imported->level.emitters[0].gain, 0.25);
  EXPECT_THAT(imported->report.found, Contains(HasSubstr("KHR_audio, read as")));
}

TEST_F(Sounds, AreReadFromTheFirstDraftOfKhrAudio) {
  khr();
  level_["extensions"] = {{"KHR_audio",
                           {{"sources", {{{"uri", "tone.wav"}}}},
                            {"emitters",
                             {{{"type", "positional"},
                               {"gain", 0.5},
                               {"loop", true},
                               {"source", 0},
                               {"positional", {{"refDistance", 3}}}}}}}}};
  level_["nodes"][0]["extensions"] = {{"KHR_audio", {{"emitter", 0}}}};
  const Level result = level();
  ASSERT_EQ(result.emitters.size(), 1u);
  EXPECT_DOUBLE_EQ(result.emitters[0].gain, 1.5);
  EXPECT_TRUE(result.signals.at(0).loop);
}

// MSFT emitters face +Z and have half angles: a hemisphere is p = 1.
TEST_F(Sounds, AreReadFromMsftAudioEmitter) {
  khr();
  level_["extensions"] = {{"MSFT_audio_emitter",
                           {{"clips", {{{"uri", "tone.wav"}}, {{"uri", "other.wav"}}}},
                            {"emitters",
                             {{{"name", "foot"},
                               {"volume", 0.5},
                               {"loop", true},
                               {"innerAngle", M_PI / 2},
                               {"outerAngle", M_PI / 2},
                               {"clips", {{{"clip", 0}}, {{"clip", 1}}}}}}}}}};
  level_["nodes"][0]["extensions"] = {{"MSFT_audio_emitter", {{"emitters", {0}}}}};
  const auto imported = import();
  ASSERT_TRUE(imported.ok()) << imported.error().message;
  ASSERT_EQ(imported->level.emitters.size(), 1u);
  const Emitter& emitter = imported->level.emitters[0];
  EXPECT_LT(length(emitter.axis - Vec3(-1, 0, 0)), 1e-9);
  EXPECT_DOUBLE_EQ(emitter.gain, 0.5);
  EXPECT_NEAR(emitter.directivity[0], 1, 1e-6);
  EXPECT_TRUE(imported->level.signals.at(0).loop);
  EXPECT_THAT(imported->report.ignored, Contains(HasSubstr("first of 2 clips")));
  EXPECT_THAT(imported->report.ignored, ::testing::Not(Contains(HasSubstr("distance model"))));
}

TEST_F(Sounds, AreReadFromOmiAudioEmitter) {
  khr();
  level_["extensions"] = {{"OMI_audio_emitter",
                           {{"audioSources", {{{"uri", "tone.wav"}}}},
                            {"audioEmitters",
                             {{{"type", "global"}, {"source", 0}},
                              {{"type", "positional"},
                               {"volume", 0.25},
                               {"loop", false},
                               {"source", 0},
                               {"coneInnerAngle", M_PI},
                               {"coneOuterAngle", M_PI},
                               {"refDistance", 2}}}}}}};
  level_["nodes"][0]["extensions"] = {{"OMI_audio_emitter", {{"audioEmitter", 1}}}};
  const Level result = level();
  ASSERT_EQ(result.emitters.size(), 1u);
  EXPECT_LT(length(result.emitters[0].axis - Vec3(1, 0, 0)), 1e-9);
  EXPECT_DOUBLE_EQ(result.emitters[0].gain, 0.5);
  EXPECT_NEAR(result.emitters[0].directivity[0], 1, 1e-6);
  EXPECT_FALSE(result.signals.at(0).loop);
}

TEST_F(Sounds, AreRejectedWithASentenceInOlderExtensionsToo) {
  khr();
  level_["extensions"] = {{"MSFT_audio_emitter",
                           {{"clips", {{{"uri", "tone.wav"}}}},
                            {"emitters", {{{"volume", "loud"}, {"clips", {{{"clip", 7}}}}}}}}}};
  level_["nodes"][0]["extensions"] = {{"MSFT_audio_emitter", {{"emitters", {0}}}}};
  EXPECT_THAT(refusal(), HasSubstr("none of the 1 there are"));
  for (const char* broken : {"7", "[1]", "{}", "\"x\"", "null"}) {
    level_["extensions"]["MSFT_audio_emitter"]["emitters"] = json::parse(broken);
    (void)import();  // must terminate
    level_["extensions"]["MSFT_audio_emitter"]["emitters"] = {json::parse(broken)};
    (void)import();
  }
}

TEST_F(Sounds, AreReadFromBufferViews) {
  khr();
  const int at = view(wav());
  level_["extensions"]["KHR_audio_emitter"]["audio"][0] = {{"bufferView", at}};
  EXPECT_EQ(level().signals.at(0).samples.size(), 24000u);
}

TEST_F(Sounds, OfAnEmitterWithTwoSourcesAreTwoEmitters) {
  khr();
  json& extension = level_["extensions"]["KHR_audio_emitter"];
  extension["sources"].push_back({{"audio", 0}, {"name", "quiet"}, {"gain", 0.1}});
  extension["emitters"][0]["sources"] = {0, 1};
  const Level result = level();
  ASSERT_EQ(result.emitters.size(), 2u);
  EXPECT_DOUBLE_EQ(result.emitters[1].gain, 0.1);
  EXPECT_FALSE(result.signals.at(result.emitters[1].signal).loop);
}

TEST_F(Sounds, OfACrowdComeFromEveryInstanceWithItsOwnDelay) {
  khr();
  level_["nodes"][0]["extensions"]["CLAMOR_emitter"] = {{"directivity", {1, 1, 1, 2, 2, 2, 3, 3}},
                                                        {"gain_db", -20},
                                                        {"delay_s", 1},
                                                        {"random_delay_s", 0.3}};
  std::vector<float> moves;
  for (int i = 0; i < 200; ++i) moves.insert(moves.end(), {static_cast<float>(i), 0, 0});
  level_["nodes"][0]["extensions"]["EXT_mesh_gpu_instancing"] = {
      {"attributes", {{"TRANSLATION", floats(moves)}}}};
  const Level result = level();
  ASSERT_EQ(result.emitters.size(), 200u);
  EXPECT_EQ(result.signals.size(), 1u);
  double mean = 0;
  for (const Emitter& emitter : result.emitters) {
    EXPECT_GE(emitter.delay_s, 1);
    EXPECT_LT(emitter.delay_s, 1.3);
    mean += (emitter.delay_s - 1) / 200;
  }
  // Standard deviation of the mean of 200 uniform values from [0, 0.3): 0.0061.
  EXPECT_NEAR(mean, 0.15, 0.025);
  EXPECT_NE(result.emitters[0].delay_s, result.emitters[1].delay_s);
  EXPECT_NEAR(result.emitters[0].gain, 0.05, 1e-12);
  EXPECT_EQ(result.emitters[0].directivity[3], 2);
  EXPECT_LT(length(result.emitters[7].position_m - Vec3(1, 2, 10)), 1e-5);  // rotated from +X to +Z
  EXPECT_EQ(level({.seed = 1}).emitters, result.emitters);
  EXPECT_NE(level({.seed = 2}).emitters, result.emitters);
}

TEST_F(Sounds, TakeClamorsExtrasOnTheKhrEmitterToo) {
  khr({{"extras", {{"clamor_emitter", {{"directivity", 4}}}}}});
  EXPECT_EQ(level().emitters.at(0).directivity, same_in_all_bands(4));
  level_["nodes"][0]["extensions"]["CLAMOR_emitter"] = {{"directivty", 4}};
  EXPECT_THAT(refusal(), HasSubstr("nearest name is 'directivity'"));
}

TEST_F(Sounds, OfAConeRadiateThePowerOfTheCone) {
  // A hemispherical cone radiates half the power: 1 / (p + 1) = 1 / 2.
  EXPECT_NEAR(exponent_of_cone(M_PI, M_PI, 0), 1, 1e-9);
  EXPECT_NEAR(exponent_of_cone(2 * M_PI, 2 * M_PI, 0), 0, 1e-9);
  // A gain of 1/4 outside a cone without width has the mean square 1 / 16.
  EXPECT_NEAR(exponent_of_cone(0, 0, 0.25), 15, 1e-9);
  khr({{"positional",
        {{"coneInnerAngle", M_PI}, {"coneOuterAngle", M_PI}, {"distanceModel", "linear"}}}});
  const auto imported = import();
  ASSERT_TRUE(imported.ok());
  EXPECT_NEAR(imported->level.emitters.at(0).directivity[0], 1, 1e-6);
  EXPECT_THAT(imported->report.ignored, Contains(HasSubstr("cone")));
  EXPECT_THAT(imported->report.ignored, Contains(HasSubstr("'linear'")));
}

TEST_F(Sounds, WithoutAPositionAreIgnoredWithAWarning) {
  khr();
  level_["extensions"]["KHR_audio_emitter"]["emitters"][0]["type"] = "global";
  const auto imported = import();
  ASSERT_TRUE(imported.ok());
  EXPECT_TRUE(imported->level.emitters.empty());
  EXPECT_THAT(imported->report.warnings, Contains(HasSubstr("global emitter")));
  EXPECT_THAT(imported->report.warnings, Contains(HasSubstr("--emitter")));
}

TEST_F(Sounds, OfTheSidecarAndTheCommandLineReplaceSoundsOfTheSameName) {
  khr();
  write("level.acoustics.json", R"({"emitters": [
      {"name": "Radio", "signal": "tone.wav", "at": [0, 0, 0], "gain": "6dB", "loop": false},
      {"signal": "noise", "at": [9, 9, 9], "facing": [0, 2, 0], "delay": 0.5}],
      "settings": {"photons": 5000, "seed": 7, "air": {"temperature_c": 0}}})");
  const auto imported = import({.emitters = {"name=noise,signal=impulse,at=1,1,1"}});
  ASSERT_TRUE(imported.ok()) << imported.error().message;
  const Level& result = imported->level;
  ASSERT_EQ(result.emitters.size(), 2u);
  EXPECT_NEAR(result.emitters[0].gain, 1.9953, 1e-4);
  EXPECT_EQ(result.emitters[1].position_m, Vec3(1, 1, 1));
  EXPECT_EQ(result.signals.at(result.emitters[1].signal).samples, std::vector<float>{1.0f});
  EXPECT_EQ(result.signals.size(), 2u) << "sounds that nothing plays are kept";
  EXPECT_EQ(imported->settings.photons, 5000u);
  EXPECT_EQ(imported->settings.seed, 7u);
  EXPECT_EQ(result.air.temperature_c, 0);
}

// A plain number is an amplitude in a sidecar, so a 0 that was meant as 0 dB is silent.
TEST_F(Sounds, WithAGainOfZeroCauseAWarning) {
  write("level.acoustics.json", R"({"emitters": [
      {"name": "Choir", "signal": "noise", "at": [0, 0, 0], "gain": 0},
      {"name": "Organ", "signal": "noise", "at": [9, 9, 9]}]})");
  const auto one = import();
  ASSERT_TRUE(one.ok()) << one.error().message;
  EXPECT_THAT(one->report.warnings, Contains(HasSubstr("'Choir' is silent, with a gain of 0")));
  const auto two = import({.emitters = {"name=Flute,signal=noise,at=1,1,1,gain=x0"}});
  ASSERT_TRUE(two.ok()) << two.error().message;
  EXPECT_THAT(two->report.warnings,
              Contains(HasSubstr("'Choir' and 1 other emitter of 3 are silent")));
  const auto none = import({.emitters = {"name=Choir,signal=noise,at=1,1,1,gain=0dB"}});
  ASSERT_TRUE(none.ok()) << none.error().message;
  EXPECT_THAT(none->report.warnings, ::testing::Not(Contains(HasSubstr("silent"))));
}

TEST_F(Sounds, DetermineTheHash) {
  khr();
  const auto hash = [&](const ImportOptions& options = {}) { return import(options)->input_hash; };
  const auto before = hash();
  EXPECT_EQ(hash(), before);
  EXPECT_NE(hash({.emitters = {"signal=impulse,at=1,1,1"}}), before);
  write("tone.wav", wav(24001));
  EXPECT_NE(hash(), before);
}

}  // namespace
}  // namespace clamor::testing
