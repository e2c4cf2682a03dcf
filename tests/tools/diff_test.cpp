#include <set>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "tests/tools/program.h"

namespace clamor {
namespace {

using testing::clamor;
using testing::Folder;

void bake(const std::string& output, std::vector<std::string> more) {
  std::vector<std::string> words = {
      "bake",         std::string(CLAMOR_SOURCE_DIR) + "/assets/levels/violin_room.glb",
      "-o",           output,
      "--no-journal", "--photons",
      "500",          "--sources",
      "2000"};
  words.insert(words.end(), more.begin(), more.end());
  const auto outcome = clamor(words);
  ASSERT_EQ(outcome.code, 0) << outcome.err;
}

TEST(DiffCommand, SaysInWhatTwoBakesDifferAndInNothingElse) {
  const Folder folder;
  const std::string a = folder / "a.clamor", b = folder / "b.clamor", c = folder / "c.clamor";
  bake(a, {});
  bake(b, {});
  bake(c, {"--seed", "2", "--emitter", "name=bell,signal=impulse,at=0,1,0"});

  const auto same = clamor({"diff", a, b});
  EXPECT_EQ(same.code, 0);
  EXPECT_NE(same.out.find("alike in all"), std::string::npos) << same.out;

  const auto other = clamor({"diff", a, c, "--json"});
  ASSERT_EQ(other.code, 0) << other.err;
  const auto json = nlohmann::json::parse(other.out);
  EXPECT_FALSE(json["alike"]);
  std::set<std::string> what;
  for (const auto& row : json["differences"]) what.insert(row["what"]);
  EXPECT_TRUE(what.contains("seed") && what.contains("emitter 'bell'") && what.contains("bytes"));
  EXPECT_FALSE(what.contains("kappa") || what.contains("level") || what.contains("tool"));
  for (const auto& row : json["differences"])
    if (row["what"] == "seed") {
      EXPECT_EQ(row["a"], "1");
      EXPECT_EQ(row["b"], "2");
    }
  // A second emitter of gain 1 beside a directional one.
  for (const double louder_db : json["level_db"]) EXPECT_GT(louder_db, 1);
  EXPECT_NE(clamor({"diff", a, c}).out.find("B louder by, dB"), std::string::npos);
}

TEST(DiffCommand, NamesTheFileThatCannotBeRead) {
  const Folder folder;
  const std::string a = folder / "a.clamor";
  bake(a, {});
  const auto outcome = clamor({"diff", a, folder / "none.clamor"});
  EXPECT_EQ(outcome.code, 1);
  EXPECT_NE(outcome.err.find("none.clamor"), std::string::npos);
}

}  // namespace
}  // namespace clamor
