#include "formats/bake_file/bake_root_portals.h"

#include "tests/formats/forged_root.h"

namespace clamor::testing {
namespace {

// Half of the reflections have passed the first portal, or both.
BakeContents contents_with_portals() {
  BakeContents bake = contents();
  bake.portals.portals = {{"Door", {1, 2, 3}, {0.5, 0, 0}, {0, 1, 0}},
                          {"", {4, 2, 3}, {0, 0.5, 0}, {0, 0, 1}}};
  bake.movable_parts = {{"Leaf", box_mesh({0.5, 1, 0.02}, 0), {}},
                        {"Door", box_mesh({0.5, 1, 0.02}, 0), {}}};
  bake.portals.portals[0].parts = {1, 0};
  bake.portals.sets = {{}, {{1, 0, 0, 0}}, {{1, 2, 0, 0}}};
  bake.portals.emitters = {{0, 1}, {0, 2}};
  for (Source& source : bake.octree.sources)
    if (!source.is_emitter) source.emitter = 1 + static_cast<std::uint32_t>(source.material);
  return bake;
}

Bytes bytes_of(const BakeContents& bake) {
  const std::string path = path_of("portals.clamor");
  const auto written = write_bake(path, bake, 1);
  EXPECT_TRUE(written.ok()) << (written.ok() ? "" : written.error().message);
  const Bytes bytes = read(path);
  std::filesystem::remove(path);
  return bytes;
}

TEST(BakedPortals, AreReadAsTheyWereWritten) {
  const BakeContents bake = contents_with_portals();
  const std::string path = path_of("portals.clamor");
  ASSERT_TRUE(write_bake(path, bake, 1).ok());
  const auto file = BakeFile::open(path);
  ASSERT_TRUE(file.ok()) << file.error().message;
  EXPECT_TRUE(file->portals() == bake.portals);
  EXPECT_EQ(file->emitters().size(), 1u);
  ASSERT_EQ(file->source_emitters().size(), 3u);
  EXPECT_TRUE(file->source_emitters()[2] == file->emitters()[0]);
  const auto all = read_expanded_sources(*file);
  ASSERT_TRUE(all.ok());
  EXPECT_EQ(all->stored_as, (std::vector<std::uint32_t>{0, 0, 0}));
  std::filesystem::remove(path);
}

TEST(BakedPortals, OfForgedRootsAreRefused) {
  using Root = BakeRoot::Builder;
  const Bytes bytes = bytes_of(contents_with_portals());
  ASSERT_TRUE(read_whole(bytes).ok());
  const std::pair<const char*, std::function<void(Root)>> forged[] = {
      {"a point of two coordinates", [](Root r) { r.getPortals().getPortals()[0].initCentreM(2); }},
      {"a part that does not exist",
       [](Root r) { r.getPortals().getPortals()[0].getParts().set(1, 2); }},
      {"a place that is no number",
       [](Root r) { r.getPortals().getPortals()[0].getCentreM().set(0, kNaN); }},
      {"a side without length",
       [](Root r) { r.getPortals().getPortals()[0].getHalfUM().set(0, 0); }},
      {"an infinite side",
       [](Root r) { r.getPortals().getPortals()[1].getHalfVM().set(0, INFINITY); }},
      {"parallel sides",
       [](Root r) {
         r.getPortals().getPortals()[0].getHalfVM().set(0, 5);
         r.getPortals().getPortals()[0].getHalfVM().set(1, 0);
       }},
      {"far outside", [](Root r) { r.getPortals().getPortals()[0].getCentreM().set(0, 1e12); }},
      {"1025 portals", [](Root r) { r.getPortals().initPortals(1025); }},
      {"no portals for the sets", [](Root r) { r.getPortals().initPortals(0); }},
      {"no sets", [](Root r) { r.getPortals().initSets(0); }},
      {"2049 sets", [](Root r) { r.getPortals().initSets(2049); }},
      {"a first set that is not empty", [](Root r) { r.getPortals().getSets().init(0, 1); }},
      {"a set of five", [](Root r) { r.getPortals().getSets().init(1, 5); }},
      {"a set of one portal twice", [](Root r) { r.getPortals().getSets().init(2, 2); }},
      {"a set of a portal that is not there",
       [](Root r) { r.getPortals().getSets()[1].set(0, 2); }},
      {"a set of portal 65535", [](Root r) { r.getPortals().getSets()[1].set(0, 0xffff); }},
      {"a virtual emitter of no emitter", [](Root r) { r.getPortals().getEmitters().set(0, 1); }},
      {"a virtual emitter of no set", [](Root r) { r.getPortals().getEmitterSets().set(0, 3); }},
      {"fewer sets than virtual emitters", [](Root r) { r.getPortals().initEmitterSets(1); }},
      {"no virtual emitters for the sources",
       [](Root r) {
         r.getPortals().initEmitterSets(0);
         r.getPortals().initEmitters(0);
       }},
  };
  for (const auto& [what, change] : forged)
    EXPECT_FALSE(read_whole(with_root(bytes, change)).ok()) << what;
}

TEST(BakedPortals, AreCheckedBeforeTheyAreWritten) {
  const auto refused = [](const std::function<void(BakeContents&)>& change) {
    BakeContents bake = contents_with_portals();
    change(bake);
    return !write_bake(path_of("refused.clamor"), bake, 1).ok();
  };
  EXPECT_FALSE(refused([](BakeContents&) {}));
  EXPECT_TRUE(refused([](BakeContents& bake) { bake.portals.emitters[0].set = 3; }));
  EXPECT_TRUE(refused([](BakeContents& bake) { bake.portals.emitters.clear(); }));
  EXPECT_TRUE(refused([](BakeContents& bake) { bake.portals.sets[1].numbers[0] = 3; }));
  EXPECT_TRUE(refused([](BakeContents& bake) { bake.portals.portals[0].half_u_m = {}; }));
  std::filesystem::remove(path_of("refused.clamor"));
}

}  // namespace
}  // namespace clamor::testing
