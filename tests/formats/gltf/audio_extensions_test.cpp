#include "formats/gltf/audio_extensions.h"

#include <gmock/gmock.h>

#include "tests/build_paths.h"
#include "tests/formats/sounding_level.h"

namespace clamor::testing {
namespace {

using ::testing::AllOf;
using ::testing::Contains;
using ::testing::HasSubstr;
using ::testing::Not;

class AudioExtensions : public SoundingLevelTest {};

// The form of Khronos' sample AudioSimple.
TEST_F(AudioExtensions, AreReadFromKhrAudio) {
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

TEST_F(AudioExtensions, AreReadFromTheFirstDraftOfKhrAudio) {
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
TEST_F(AudioExtensions, AreReadFromMsftAudioEmitter) {
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

TEST_F(AudioExtensions, AreReadFromOmiAudioEmitter) {
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

TEST_F(AudioExtensions, WithFaultsCostTheirEmitterInOlderFormsToo) {
  khr();
  level_["extensions"] = {{"MSFT_audio_emitter",
                           {{"clips", {{{"uri", "tone.wav"}}}},
                            {"emitters", {{{"volume", 1}, {"clips", {{{"clip", 7}}}}}}}}}};
  level_["nodes"][0]["extensions"] = {{"MSFT_audio_emitter", {{"emitters", {0}}}}};
  const auto dangling = import();
  ASSERT_TRUE(dangling.ok()) << dangling.error().message;
  EXPECT_THAT(dangling->report.warnings, Contains(HasSubstr("'audio' points to entry 7 of 1")));
  level_.erase("extensions");
  const auto without_lists = import();
  ASSERT_TRUE(without_lists.ok()) << without_lists.error().message;
  EXPECT_THAT(without_lists->report.warnings, Contains(HasSubstr("entry 0 of 0")));
  for (const char* broken : {"7", "[1]", "{}", "\"x\"", "null"}) {
    level_["extensions"]["MSFT_audio_emitter"]["emitters"] = json::parse(broken);
    (void)import();  // must terminate
    level_["extensions"]["MSFT_audio_emitter"]["emitters"] = {json::parse(broken)};
    (void)import();
  }
}

TEST_F(AudioExtensions, NameABetterEncodingOfASource) {
  khr();
  write("better.ogg", wav(4800));
  json& extension = level_["extensions"]["KHR_audio_emitter"];
  extension["audio"].push_back({{"uri", "better.ogg"}});
  for (const char* codec : {"OMI_audio_ogg_vorbis", "OMI_audio_opus"}) {
    SCOPED_TRACE(codec);
    extension["sources"][0] = {{"audio", 0}, {"extensions", {{codec, {{"audio", 1}}}}}};
    EXPECT_EQ(level().signals.at(0).samples.size(), 4800u);
    extension["sources"][0].erase("audio");
    level_["extensionsUsed"] = level_["extensionsRequired"] = {codec, "KHR_audio_emitter"};
    const auto alone = import();
    ASSERT_TRUE(alone.ok()) << alone.error().message;
    EXPECT_EQ(alone->level.signals.at(0).samples.size(), 4800u);
    EXPECT_THAT(alone->report.ignored, Not(Contains(HasSubstr("OMI"))));
  }
  extension["sources"][0]["audio"] = 0;
  write("better.ogg", "no sound");
  EXPECT_EQ(level().signals.at(0).samples.size(), 24000u) << "the fallback is not read";
}

TEST_F(AudioExtensions, ThatAreUnknownAreNamed) {
  khr();
  level_["nodes"][0]["extensions"]["KHR_audio_graph"] = json::object();
  level_["scenes"] = {{{"nodes", {0}}, {"extensions", {{"ACME_SoundScape", json::object()}}}}};
  level_["extensionsUsed"] = {"KHR_audio_emitter", "EXT_audio_environment", "KHR_lights_punctual"};
  level_["extensionsRequired"] = {"EXT_audio_environment"};
  const auto imported = import();
  ASSERT_TRUE(imported.ok()) << imported.error().message;
  EXPECT_THAT(
      imported->report.ignored,
      AllOf(Contains(HasSubstr("KHR_audio_graph, which Clamor does not read (of node 'Radio'")),
            Contains(HasSubstr("ACME_SoundScape")), Contains(HasSubstr("EXT_audio_environment")),
            Not(Contains(HasSubstr("KHR_lights"))), Not(Contains(HasSubstr("KHR_audio_emitter")))));
  EXPECT_EQ(imported->level.emitters.size(), 1u);
}

TEST_F(AudioExtensions, OfMozillaHubsAreRead) {
  write("radio.wav", wav());
  triangle();
  level_["nodes"][0]["extensions"]["MOZ_hubs_components"] = {{"visible", {{"visible", false}}}};
  node({{"name", "Radio"},
        {"translation", {1, 2, 3}},
        {"extensions",
         {{"MOZ_hubs_components",
           {{"audio", {{"src", "radio.wav"}, {"autoPlay", true}, {"loop", false}}},
            {"audio-params",
             {{"audioType", "pannernode"},
              {"gain", 0.5},
              {"coneInnerAngle", 180},
              {"coneOuterAngle", 180},
              {"coneOuterGain", 0}}}}}}}});
  node({{"name", "Lounge"},
        {"extensions", {{"MOZ_hubs_components", {{"audio-zone", {{"inOut", true}}}}}}}});
  const auto imported = import();
  ASSERT_TRUE(imported.ok()) << imported.error().message;
  ASSERT_EQ(imported->level.emitters.size(), 1u);
  const Emitter& emitter = imported->level.emitters[0];
  EXPECT_EQ(emitter.name, "Radio");
  EXPECT_DOUBLE_EQ(emitter.gain, 0.5);
  EXPECT_NEAR(emitter.directivity[0], 1, 1e-6);  // a hemisphere
  EXPECT_FALSE(imported->level.signals.at(0).loop);
  EXPECT_TRUE(imported->level.mesh.triangles.empty());
  EXPECT_THAT(imported->report.found, Contains(HasSubstr("MOZ_hubs_components, read as")));
  EXPECT_THAT(imported->report.ignored, Contains(HasSubstr("audio-zone of node 'Lounge'")));
}

// GLTFExporter of three.js keeps the reference of a node and drops the list that it points to.
TEST_F(AudioExtensions, OfMozillaHubsDoNotStandInForADroppedList) {
  write("fan.wav", wav());
  triangle();
  node({{"name", "Radio"}, {"extensions", {{"KHR_audio_emitter", {{"emitter", 0}}}}}});
  node({{"name", "Fan"},
        {"extensions", {{"MOZ_hubs_components", {{"audio", {{"src", "fan.wav"}}}}}}}});
  const auto imported = import();
  ASSERT_TRUE(imported.ok()) << imported.error().message;
  ASSERT_EQ(imported->level.emitters.size(), 1u);
  EXPECT_EQ(imported->level.emitters[0].name, "Fan");
  EXPECT_THAT(imported->report.warnings, Contains(HasSubstr("'Radio' is left out")));
}

// Levels of other programs, where they are at hand.
TEST(AudioExtensionsOfOthers, AreHeardOrNamed) {
  const struct {
    const char* file;
    std::size_t emitters;
    const char* line;  // of what is ignored or warned of
  } cases[] = {{"codec_extensions_without_fallback/ogg_only.glb", 1, ""},
               {"codec_extensions_without_fallback/ogg_required.glb", 1, ""},
               {"hubs_audio_not_mentioned/hubs.glb", 1, "1 hidden mesh"},
               {"khr_audio_autoplay_and_pitch/autoplay_false.glb", 1, "autoplay false of source 0"},
               {"khr_audio_autoplay_and_pitch/pitchspeed_2.glb", 1, ""},
               {"ref_distance_gain_silent/ref20.glb", 1, "refDistance 20 m: +26.0 dB"},
               {"three_custom/room_three.glb", 0, "entry 0 of 0"},
               {"pipeline_sound/pl_def.glb", 1, "holds no sound"}};
  if (!std::filesystem::exists(shared_case(cases[0].file))) GTEST_SKIP() << "no shared cases here";
  for (const auto& [file, emitters, line] : cases) {
    SCOPED_TRACE(file);
    const auto imported = import_level(shared_case(file), {});
    ASSERT_TRUE(imported.ok()) << imported.error().message;
    EXPECT_EQ(imported->level.emitters.size(), emitters);
    std::vector<std::string> said = imported->report.ignored;
    said.insert(said.end(), imported->report.warnings.begin(), imported->report.warnings.end());
    if (*line != '\0') {
      EXPECT_THAT(said, Contains(HasSubstr(line)));
    }
  }
}

}  // namespace
}  // namespace clamor::testing
