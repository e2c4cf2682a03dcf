#include "formats/gltf/gltf_sounds.h"

#include <gmock/gmock.h>

#include "formats/gltf/khr_audio.h"
#include "tests/formats/sounding_level.h"

namespace clamor::testing {
namespace {

using ::testing::AllOf;
using ::testing::Contains;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::Not;

class Sounds : public SoundingLevelTest {};

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
  const std::string spec = "name=Radio,at=0,0,0,signal=" + folder_ + "/tone.wav";
  const auto added = import({.emitters = {spec}});
  ASSERT_TRUE(added.ok());
  EXPECT_THAT(added->report.ignored, Contains(HasSubstr("2 channels of '" + folder_)));
  EXPECT_THAT(added->report.warnings, Not(Contains(HasSubstr("silent"))));
  std::fill(stereo.begin() + 44, stereo.end(), '\0');
  write("tone.wav", stereo);
  EXPECT_THAT(import()->report.warnings, Contains(HasSubstr("'tone.wav' is silent")));
  EXPECT_THAT(import({.emitters = {spec}})->report.warnings,
              Contains(HasSubstr("tone.wav' is silent")));
}

TEST_F(Sounds, AreReadInTheOldSpelling) {
  khr();
  level_["nodes"][0]["extensions"]["KHR_audio_emitter"] = {{"emitter", 0}};
  level_["extensions"]["KHR_audio_emitter"]["sources"][0]["autoPlay"] = true;
  EXPECT_EQ(level().emitters.size(), 1u);
}

TEST_F(Sounds, AreReadFromBufferViews) {
  khr();
  const int at = view(wav());
  level_["extensions"]["KHR_audio_emitter"]["audio"][0] = {{"bufferView", at}};
  EXPECT_EQ(level().signals.at(0).samples.size(), 24000u);
}

TEST_F(Sounds, OfABufferViewWithoutSoundCostTheirEmitter) {
  khr();
  const int at = view(raw(std::vector<float>(12, 0.5f)));
  level_["extensions"]["KHR_audio_emitter"]["audio"][0] = {{"bufferView", at}};
  const auto imported = import();
  ASSERT_TRUE(imported.ok()) << imported.error().message;
  EXPECT_TRUE(imported->level.emitters.empty());
  EXPECT_THAT(imported->report.warnings,
              Contains(AllOf(HasSubstr("'Radio' is left out"), HasSubstr("renumber or drop views"),
                             HasSubstr("at=1,2,3"))));
}

TEST_F(Sounds, WithADanglingReferenceAreLeftOutAndTheOthersHeard) {
  khr();
  for (int i = 0; i < 3; ++i)
    node({{"extensions", {{"KHR_audio_emitter", {{"emitters", {7, 0}}}}}}});
  const auto imported = import();
  ASSERT_TRUE(imported.ok()) << imported.error().message;
  EXPECT_EQ(imported->level.emitters.size(), 4u);
  EXPECT_THAT(imported->report.warnings,
              ElementsAre(AllOf(HasSubstr("node 1 and 2 more are left out"),
                                HasSubstr("'emitters' points to entry 7 of 1"))));
  level_["extensions"].erase("KHR_audio_emitter");  // as three.js does
  const auto without = import();
  ASSERT_TRUE(without.ok()) << without.error().message;
  EXPECT_TRUE(without->level.emitters.empty());
  EXPECT_THAT(without->report.warnings, Contains(HasSubstr("entry 0 of 0 (tools that do not")));
}

TEST_F(Sounds, ThatWaitForTheGameAreReported) {
  khr();
  json& source = level_["extensions"]["KHR_audio_emitter"]["sources"][0];
  for (const char* key : {"autoplay", "autoPlay"}) {
    source[key] = false;
    EXPECT_THAT(import()->report.ignored, Contains(HasSubstr("autoplay false of source 0")));
    source[key] = true;
    EXPECT_THAT(import()->report.ignored, Not(Contains(HasSubstr("autoplay"))));
    source.erase(key);
    EXPECT_THAT(import()->report.ignored, Contains(HasSubstr("autoplay false of source 0")))
        << "false is the default";
  }
}

// Half the duration and twice the frequency of 1 kHz.
TEST_F(Sounds, PlayAtTheirSpeed) {
  khr();
  json& source = level_["extensions"]["KHR_audio_emitter"]["sources"][0];
  for (const char* key : {"pitchSpeed", "playbackRate"}) {
    source[key] = 2;
    const std::vector<float> samples = level().signals.at(0).samples;
    EXPECT_EQ(samples.size(), 12000u) << key;
    int rises = 0;
    for (std::size_t i = 1; i < samples.size(); ++i) rises += samples[i - 1] < 0 && samples[i] >= 0;
    EXPECT_NEAR(rises, 500, 1) << key;  // 2 kHz for a quarter of a second
    source.erase(key);
  }
  source["playbackRate"] = -1;
  const auto backwards = import();
  ASSERT_TRUE(backwards.ok());
  EXPECT_EQ(backwards->level.signals.at(0).samples.size(), 24000u);
  EXPECT_THAT(backwards->report.ignored, Contains(HasSubstr("playback rate -1")));
}

TEST_F(Sounds, KeepTheirLevelAtTheReferenceDistanceAndSaySo) {
  khr({{"positional", {{"refDistance", 20}}}});
  const auto imported = import();
  ASSERT_TRUE(imported.ok());
  EXPECT_DOUBLE_EQ(imported->level.emitters.at(0).gain / 20, 0.5);  // 1 / r at 20 m
  EXPECT_THAT(imported->report.ignored, Contains(HasSubstr("refDistance 20 m: +26.0 dB at 1 m")));
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
