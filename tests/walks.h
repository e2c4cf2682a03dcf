// walks.h: a walk for tests, and keyframes along a walk.
#pragma once

#include <gtest/gtest.h>

#include "formats/level/walk_file.h"
#include "runtime/engine/auralizer.h"
#include "tests/temporary_file.h"

namespace clamor::testing {

// Walks from corner to corner of baked_room() while turning, in a second and a half.
inline Walk across_the_room() {
  const TemporaryFile file(".json", R"({"points":[{"time_s":0,"position_m":[1,1,1.6],"yaw_deg":0},)"
                                    R"({"time_s":0.8,"position_m":[5,4,1.6],"yaw_deg":170},)"
                                    R"({"time_s":1.5,"position_m":[2,7,1.2],"yaw_deg":-90}]})");
  auto walk = Walk::read(file.path());
  EXPECT_TRUE(walk.ok());
  return walk.ok() ? *walk : Walk::standing({});
}

// Makes as many keyframes as the auralizer wants, each with the walk's listener at its time.
inline void make_keyframes(Auralizer& auralizer, const Walk& walk) {
  while (auralizer.wants_keyframe())
    auralizer.make_keyframe(walk.at(auralizer.next_keyframe_time_s()));
}

}  // namespace clamor::testing
