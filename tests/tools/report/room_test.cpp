// Tests which sources of a bake a report reads.
#include "tools/report/room.h"

#include <algorithm>

#include "formats/bake_file/expanded_sources.h"
#include "formats/bake_file/source_octree.h"
#include "tests/stadium_level.h"
#include "tests/tools/report/reported_room.h"

namespace clamor::testing {
namespace {

std::vector<float> keys_of(const std::vector<Source>& sources) {
  std::vector<float> keys;
  for (const Source& source : sources)
    if (!source.is_image) keys.push_back(octree_key(source));
  std::sort(keys.rbegin(), keys.rend());
  return keys;
}

TEST(StrongestSources, AreThoseOfASortOfAllAndNameTheKeyThatIsMissing) {
  const ReportedRoom reported(shoebox({6, 4, 3}, uniform_material(0.2f), {2, 1, 1}));
  const std::vector<float> all = keys_of(read_expanded_sources(reported.file())->sources);
  ASSERT_GT(all.size(), 10'000u);
  for (const std::size_t count : {std::size_t{1}, std::size_t{700}, std::size_t{9000}}) {
    const auto strongest = read_strongest_sources(reported.file(), count);
    ASSERT_TRUE(strongest.ok());
    const std::vector<float> keys = keys_of(strongest->sources);
    EXPECT_LE(keys.size(), count);
    EXPECT_GT(strongest->missing_key, 0);
    // All above the missing key are there, and no others.
    EXPECT_EQ(keys.size(),
              static_cast<std::size_t>(std::count_if(all.begin(), all.end(), [&](float key) {
                return static_cast<double>(key) > strongest->missing_key;
              })));
    EXPECT_TRUE(std::equal(keys.begin(), keys.end(), all.begin()));
    EXPECT_GE(2 * keys.size() + 1, count) << "hardly more than a page may be dropped again";
  }
}

TEST(StrongestSources, AreAllWhereThereAreNoMore) {
  const ReportedRoom reported(shoebox({6, 4, 3}, uniform_material(0.2f), {2, 1, 1}), 100, 2000);
  const auto all = read_expanded_sources(reported.file());
  const auto strongest = read_strongest_sources(reported.file(), 1'000'000);
  EXPECT_EQ(strongest->missing_key, 0);
  EXPECT_EQ(keys_of(strongest->sources), keys_of(all->sources));
}

TEST(StrongestSources, OfInstancesAreThoseOfASortOfAll) {
  StadiumLevel stadium;
  stadium.build();
  BakeOptions options{.settings = {.photons = 500, .sources = 2000}, .threads = 1};
  options.groups = stadium.groups;
  const auto contents = bake(stadium.level, options);
  ASSERT_FALSE(contents->prototypes.empty());
  const Folder folder;
  ASSERT_TRUE(write_bake(folder / "stadium.clamor", *contents, 1).ok());
  const auto file = BakeFile::open(folder / "stadium.clamor");
  const std::vector<float> all = keys_of(read_expanded_sources(*file)->sources);
  const auto strongest = read_strongest_sources(*file, 500);
  const std::vector<float> keys = keys_of(strongest->sources);
  ASSERT_GT(keys.size(), 100u);
  EXPECT_TRUE(std::equal(keys.begin(), keys.end(), all.begin()));
}

TEST(Excitation, IsTheFirstEmitterUnlessAnotherIsNamed) {
  Level level = shoebox({6, 4, 3}, uniform_material(0.2f), {2, 1, 1});
  level.emitters.push_back(level.emitters[0]);
  level.emitters[1].name = "bell";
  level.emitters[1].gain = 2;
  const ReportedRoom reported(level);
  const Room room = reported.room();
  EXPECT_EQ(excitation_of(room, "")->emitter, 0u);
  const auto bell = excitation_of(room, "bell");
  EXPECT_EQ(bell->emitter, 1u);
  EXPECT_NEAR(static_cast<double>(bell->energy_at_10m[3]), 4.0 / 100, 1e-8);  // gain^2 / r^2
  const auto none = excitation_of(room, "bel");
  ASSERT_FALSE(none.ok());
  EXPECT_NE(none.error().message.find("nearest of 2 names is 'bell'"), std::string::npos);
}

}  // namespace
}  // namespace clamor::testing
