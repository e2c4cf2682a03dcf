// walks.h: where a listener walks in tests.
#pragma once

#include <filesystem>
#include <fstream>
#include <string>

#include <gtest/gtest.h>
#include <unistd.h>

#include "formats/walk_file.h"

namespace clamor::testing {

// From corner to corner of baked_room(), turning, in a second and a half.
inline Walk across_the_room() {
  const auto path = std::filesystem::temp_directory_path() /
                    ("clamor_render_" + std::to_string(::getpid()) + ".json");
  std::ofstream(path) << R"({"points":[{"time_s":0,"position_m":[1,1,1.6],"yaw_deg":0},)"
                         R"({"time_s":0.8,"position_m":[5,4,1.6],"yaw_deg":170},)"
                         R"({"time_s":1.5,"position_m":[2,7,1.2],"yaw_deg":-90}]})";
  auto walk = Walk::read(path.string());
  std::filesystem::remove(path);
  EXPECT_TRUE(walk.ok());
  return walk.ok() ? *walk : Walk::standing({});
}

}  // namespace clamor::testing
