// Tests that inspect counts instances as if every one were written out.
#include <algorithm>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "bake/bake.h"
#include "formats/bake_file/bake_writer.h"
#include "formats/bake_file/expanded_sources.h"
#include "tests/stadium_level.h"
#include "tests/tools/run_clamor.h"

namespace clamor::testing {

namespace {

// Fans in blocks in stands and three alone, above ground or in a free field. `told`: with the
// statistics of the tracing, which other writers of the format may leave out.
void write_stadium(const std::string& path, bool ground, bool told) {
  StadiumLevel stadium;
  stadium.ground = ground;
  stadium.build();
  for (int i = 0; i < 3; ++i) {
    Emitter& alone = stadium.level.emitters.emplace_back(stadium.level.emitters.front());
    alone.name = "steward #" + std::to_string(i);
    alone.position_m = {5.0 * i, 2, 3};
  }
  BakeOptions options{.settings = {.photons = 500, .sources = 2000}, .threads = 1};
  options.groups = stadium.groups;
  auto contents = bake(stadium.level, options);
  ASSERT_TRUE(contents.ok());
  ASSERT_FALSE(contents->prototypes.empty());
  if (!told) contents->statistics = {};
  ASSERT_TRUE(write_bake(path, *contents, 1).ok());
}

nlohmann::json inspected(const std::string& path) {
  const Outcome outcome = clamor({"inspect", path, "--json"});
  EXPECT_EQ(outcome.code, 0) << outcome.err;
  return nlohmann::json::parse(outcome.out);
}

TEST(InspectInstances, CountsEveryEmitterOfALevelAboveAGroundAndInAFreeField) {
  const Folder folder;
  const std::string path = folder / "stadium.clamor";
  for (const bool ground : {true, false})
    for (const bool told : {true, false}) {
      write_stadium(path, ground, told);
      const auto file = BakeFile::open(path);
      ASSERT_TRUE(file.ok());
      const auto all = read_expanded_sources(*file);
      ASSERT_TRUE(all.ok());
      const auto emitters = std::count_if(all->sources.begin(), all->sources.end(),
                                          [](const Source& source) { return source.is_emitter; });
      ASSERT_EQ(emitters, 963);
      const nlohmann::json json = inspected(path);
      EXPECT_EQ(json["sources"]["emitters"], emitters) << ground << told;
      EXPECT_EQ(json["sources"]["secondary"], all->sources.size() - 963) << ground << told;
      EXPECT_EQ(json["sources"]["total"], all->sources.size());
      if (!ground) {
        EXPECT_LT(json["emitters"].size(), 963u);
      }
    }
}

TEST(InspectInstances, SaysThatAFreeFieldListsStoredEmittersOnly) {
  const Folder folder;
  const std::string path = folder / "stadium.clamor";
  write_stadium(path, false, true);
  const std::string text = clamor({"inspect", path}).out;
  EXPECT_NE(text.find("963 emitters and 0 secondary sources"), std::string::npos) << text;
  const std::size_t listed = inspected(path)["emitters"].size();
  EXPECT_NE(text.find("\n" + std::to_string(listed) + " emitters stored "), std::string::npos)
      << text;
  write_stadium(path, true, true);
  EXPECT_NE(clamor({"inspect", path}).out.find("\n963 emitters "), std::string::npos);
}

}  // namespace

}  // namespace clamor::testing
