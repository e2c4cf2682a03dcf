// sounding_level.h: a level with one KHR emitter.
#pragma once

#include <cmath>

#include "tests/formats/level_builder.h"

namespace clamor::testing {

class SoundingLevelTest : public LevelTest {
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

}  // namespace clamor::testing
