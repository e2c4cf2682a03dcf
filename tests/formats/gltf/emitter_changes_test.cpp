// Tests of emitters that a sidecar changes or removes, and of its listeners.
#include <gmock/gmock.h>

#include "tests/formats/level_builder.h"

namespace clamor::testing {
namespace {

using ::testing::HasSubstr;

class EmitterChanges : public LevelTest {
 protected:
  // A radio in the level at (1, 2, 3), and a sidecar.
  void radio_with(const std::string& sidecar) {
    write("tone.wav", wav());
    level_["extensions"]["KHR_audio_emitter"] = {
        {"audio", {{{"uri", "tone.wav"}}}},
        {"sources", {{{"audio", 0}, {"gain", 0.5}, {"loop", true}}}},
        {"emitters", {{{"sources", {0}}, {"type", "positional"}}}}};
    node({{"name", "Radio"},
          {"translation", {1, 2, 3}},
          {"extensions", {{"KHR_audio_emitter", {{"emitters", {0}}}}}}});
    write("level.acoustics.json", sidecar);
  }
};

TEST_F(EmitterChanges, KeepWhatTheyDoNotGive) {
  radio_with(R"({"emitters": [{"name": "Radio", "facing": [0, 0, 2], "directivity": 3}]})");
  const Level result = level();
  ASSERT_EQ(result.emitters.size(), 1u);
  EXPECT_EQ(result.emitters[0].axis, Vec3(0, 0, 1));
  EXPECT_EQ(result.emitters[0].directivity, same_in_all_bands(3));
  EXPECT_EQ(result.emitters[0].position_m, Vec3(1, 2, 3));
  EXPECT_EQ(result.emitters[0].gain, 0.5);
  EXPECT_EQ(result.signals.at(result.emitters[0].signal).samples.size(), 24000u);
}

TEST_F(EmitterChanges, RemoveTheLevelsEmitterWithItsSound) {
  radio_with(R"({"emitters": [{"name": "Radio", "removed": true},
                              {"name": "hiss", "signal": "noise", "at": [0, 1, 0]}]})");
  const Level result = level();
  ASSERT_EQ(result.emitters.size(), 1u);
  EXPECT_EQ(result.emitters[0].name, "hiss");
  EXPECT_EQ(result.signals.size(), 1u);
}

TEST_F(EmitterChanges, OfAnEmitterThatIsNotThereNameTheNearest) {
  radio_with(R"({"emitters": [{"name": "Radoi", "gain": 2}]})");
  EXPECT_THAT(refusal(), HasSubstr("'Radoi', which the level does not have; the nearest name is "
                                   "'Radio'"));
}

TEST_F(EmitterChanges, SayThatTheyAreChangesWhereAMemberIsUnknown) {
  radio_with(R"({"emitters": [{"name": "Radio", "sound": "noise"}]})");
  EXPECT_THAT(refusal(), HasSubstr("Without a 'signal'"));
}

TEST_F(EmitterChanges, LeaveListenersToTools) {
  radio_with(
      R"({"listeners": [{"name": "row 5", "at": [0, 1.2, 6], "yaw": 90}, {"at": [1, 1, 1]}]})");
  const auto imported = import();
  ASSERT_TRUE(imported.ok());
  ASSERT_EQ(imported->listeners.size(), 2u);
  EXPECT_EQ(imported->listeners[0], (ListenerSpec{"row 5", {0, 1.2, 6}, 90, 0}));
  EXPECT_EQ(imported->listeners[1].name, "listener 2");
}

}  // namespace
}  // namespace clamor::testing
