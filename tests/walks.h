// walks.h: a walk for tests.
#pragma once

#include <gtest/gtest.h>

#include "formats/level/walk_file.h"
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

}  // namespace clamor::testing
