// Tests that inspect prints valid text and JSON whatever names a bake file holds.
#include <algorithm>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "tests/tools/run_clamor.h"

namespace clamor::testing {

namespace {

// Bakes a free field with an emitter of that name.
std::string baked(const Folder& folder, const std::string& name) {
  const std::string level = folder.write("level.gltf", kEmptyLevel), file = folder / "a.clamor";
  const Outcome outcome = clamor({"bake", level, "-o", file, "--quiet", "--photons", "10",
                                  "--emitter", "name=" + name + ",signal=noise,at=0,1,0"});
  EXPECT_EQ(outcome.code, 0) << outcome.err;
  return file;
}

TEST(Inspect, WritesJsonThatCanBeReadThoughANameIsNotUtf8) {
  const Folder folder;
  const Outcome outcome = clamor({"inspect", baked(folder, "Fl\xfcgel"), "--json"});
  ASSERT_EQ(outcome.code, 0) << outcome.err;
  const auto json = nlohmann::json::parse(outcome.out);
  EXPECT_EQ(json["emitters"][0]["name"], "Fl\xef\xbf\xbdgel");
}

TEST(Inspect, PrintsNoControlCharacterThatANameHolds) {
  const Folder folder;
  const Outcome outcome = clamor({"inspect", baked(folder, "a\033[2Jb")});
  ASSERT_EQ(outcome.code, 0) << outcome.err;
  EXPECT_NE(outcome.out.find("a?[2Jb"), std::string::npos) << outcome.out;
  EXPECT_TRUE(
      std::none_of(outcome.out.begin(), outcome.out.end(), [](char c) { return c == '\033'; }));
}

}  // namespace

}  // namespace clamor::testing
