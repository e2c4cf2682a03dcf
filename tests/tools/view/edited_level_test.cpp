#include "tools/view/edited_level.h"

#include <algorithm>
#include <filesystem>

#include <gmock/gmock.h>

#include "formats/gltf/level_import.h"
#include "formats/level/movable_part.h"
#include "tests/box_level.h"
#include "tests/door_level.h"
#include "tests/tools/run_clamor.h"
#include "tools/view/level_sounds.h"

namespace clamor::testing {
namespace {

using ::testing::HasSubstr;

class EditedLevelTest : public ::testing::Test {
 protected:
  void SetUp() override {
    path_ = box_level(folder_);
    folder_.write("box.acoustics.json", R"({"comment": "kept", "emitters": [
      {"name": "violin", "signal": "noise", "at": [1, 1, 1]}], "materials": {"*": "brick"}})");
  }

  EditedLevel opened() const {
    auto level = EditedLevel::open(path_, {});
    EXPECT_TRUE(level.ok()) << (level.ok() ? "" : level.error().message);
    return std::move(*level);
  }

  // Returns the level as a bake would read it.
  Level baked(const EditedLevel& level) const {
    auto imported = import_level(path_, level.import_options());
    EXPECT_TRUE(imported.ok()) << (imported.ok() ? "" : imported.error().message);
    return imported.ok() ? imported->level : Level{};
  }

  std::string sidecar() const { return read(folder_ / "box.acoustics.json"); }

  const Folder folder_;
  std::string path_;
};

TEST_F(EditedLevelTest, ShowsTheValuesThatABakeReads) {
  EditedLevel level = opened();
  Material material = level.now().materials[0];
  material.absorption[2] = 0.55f;
  material.scattering = same_in_all_bands(0.25f);
  level.set_material(0, material);
  Emitter violin = level.now().emitters[0];
  violin.position_m = {2, 1.5, 3};
  violin.axis = {1, 0, 0};
  violin.gain = 0.5;
  violin.directivity = same_in_all_bands(2);
  level.set_emitter(0, violin);
  ASSERT_TRUE(level.add_emitter("impulse", {1, 2, 1}, {0, 0, -1}).ok());
  level.add_listener({"row 1", {2, 1.2, 4}, 30, 0});
  ASSERT_TRUE(level.autosave().ok());

  const Level read_back = baked(level);
  EXPECT_EQ(read_back.materials, level.now().materials);
  ASSERT_EQ(read_back.emitters.size(), 2u);
  for (std::size_t i = 0; i < 2; ++i) {
    const Emitter& shown = level.now().emitters[i];
    EXPECT_EQ(read_back.emitters[i].name, shown.name);
    EXPECT_EQ(read_back.emitters[i].position_m, shown.position_m);
    EXPECT_EQ(read_back.emitters[i].axis, shown.axis);
    EXPECT_EQ(read_back.emitters[i].gain, shown.gain);
    EXPECT_EQ(read_back.emitters[i].directivity, shown.directivity);
  }
}

// The sidecar has the world's coordinates, the values that are edited have the level's.
TEST_F(EditedLevelTest, WritesPlacesInTheWorld) {
  Mesh box = testing::box({4, 3, 5});
  for (Vec3f& vertex : box.vertices_m) vertex += Vec3f(560'000, 0, -180'400);
  path_ = level_of(folder_, box);
  folder_.write("box.acoustics.json",
                R"({"emitters": [{"name": "violin", "signal": "noise", "at": [560001, 1, -180399]}],
                    "listeners": [{"name": "row 1", "at": [560002, 1, -180398]}]})");
  EditedLevel level = opened();
  EXPECT_EQ(level.origin_m(), Vec3(560'000, 0, -180'400));
  Emitter violin = level.now().emitters[0];
  EXPECT_EQ(violin.position_m, Vec3(1, 1, 1));
  violin.position_m.x = 1.5;
  level.set_emitter(0, violin);
  ASSERT_TRUE(level.add_emitter("impulse", {1, 2, 1}, {0, 0, -1}).ok());
  ListenerSpec row = level.now().listeners[0];
  EXPECT_EQ(row.at_m, Vec3(2, 1, 2));
  row.at_m.z = 3;
  level.set_listener(0, row);
  ASSERT_TRUE(level.save().ok());
  for (const char* place : {"[560001.5,1,-180399]", "[560001,2,-180399]", "[560002,1,-180397]"})
    EXPECT_THAT(sidecar(), HasSubstr(place));
  EXPECT_EQ(baked(level).emitters[0].position_m, violin.position_m);
}

TEST_F(EditedLevelTest, WritesTheSidecarOnlyWhenItIsSavedAndNeverTheLevel) {
  const std::string before = sidecar(), mesh = read(path_);
  EditedLevel level = opened();
  ASSERT_TRUE(level.set_preset(0, "carpet").ok());
  ASSERT_TRUE(level.autosave().ok());
  EXPECT_EQ(sidecar(), before);
  ASSERT_TRUE(level.save().ok());
  EXPECT_THAT(sidecar(), HasSubstr("\"carpet\""));
  EXPECT_THAT(sidecar(), HasSubstr("\"kept\""));
  EXPECT_EQ(read(path_), mesh);
  EXPECT_FALSE(std::filesystem::exists(level.autosave_path()));
  EXPECT_EQ(opened().now().presets[0], "carpet");
}

TEST_F(EditedLevelTest, UndoesAGestureInOneStepAndRedoesIt) {
  EditedLevel level = opened();
  const std::string first = level.sidecar_text();
  Material material = level.now().materials[0];
  for (const float value : {0.1f, 0.2f, 0.3f}) {
    material.absorption = same_in_all_bands(value);
    level.set_material(0, material, 7);
  }
  const std::string last = level.sidecar_text();
  level.undo();
  EXPECT_EQ(level.sidecar_text(), first);
  EXPECT_TRUE(level.is_saved());
  EXPECT_FALSE(level.history().can_undo());
  level.redo();
  EXPECT_EQ(level.sidecar_text(), last);
  level.undo();
  level.remove_emitter(0);
  EXPECT_FALSE(level.history().can_redo());
}

TEST_F(EditedLevelTest, OffersUnsavedWorkAfterACrash) {
  {
    EditedLevel level = opened();
    ASSERT_TRUE(level.set_preset(0, "carpet").ok());
    ASSERT_TRUE(level.autosave().ok());
  }  // and no save
  EditedLevel next = opened();
  ASSERT_TRUE(next.has_unsaved_work());
  EXPECT_EQ(next.now().presets[0], "brick") << "it is offered, not taken";
  ASSERT_TRUE(next.autosave().ok());
  EXPECT_TRUE(std::filesystem::exists(next.autosave_path())) << "not lost before the answer";
  ASSERT_TRUE(next.recover().ok());
  EXPECT_EQ(next.now().presets[0], "carpet");
  next.undo();
  EXPECT_EQ(next.now().presets[0], "brick");
}

TEST_F(EditedLevelTest, DiscardsUnsavedWorkThatIsNotWanted) {
  folder_.write("box.acoustics.json.unsaved", R"({"materials": {"*": "carpet"}})");
  EditedLevel level = opened();
  ASSERT_TRUE(level.has_unsaved_work());
  level.discard_autosave();
  EXPECT_FALSE(opened().has_unsaved_work());
}

TEST_F(EditedLevelTest, SaysWhichEmittersASidecarCannotChange) {
  ImportOptions options;
  options.emitters = {"name=violin,signal=noise,at=1,1,1"};
  auto level = EditedLevel::open(path_, options);
  ASSERT_TRUE(level.ok());
  EXPECT_THAT(level->why_fixed(0), HasSubstr("command line"));
  level->remove_emitter(0);
  EXPECT_EQ(level->now().emitters.size(), 1u);
}

TEST_F(EditedLevelTest, AddsSoundsOfItsFolderHoweverTheyAreNamed) {
  std::filesystem::create_directories(folder_ / "sounds");
  std::filesystem::copy_file(std::string(kSourceDir) + "/assets/levels/sounds/violin.flac",
                             folder_ / "sounds/50% violin.flac");
  folder_.write("sounds/notes.txt", "no sound");
  EXPECT_THAT(sounds_beside(path_), ::testing::ElementsAre("sounds/50% violin.flac"));
  EditedLevel level = opened();
  for (const std::string& file :
       {std::string("sounds/50% violin.flac"), folder_ / "sounds/50% violin.flac"})
    ASSERT_TRUE(level.add_emitter(file, {1, 1, 1}, {0, 0, 1}).ok()) << file;
  ASSERT_TRUE(level.autosave().ok());
  EXPECT_EQ(level.now().emitters[1].name, "50% violin");
  EXPECT_EQ(baked(level).emitters.size(), 3u);
}

TEST_F(EditedLevelTest, SaysInPlainWordsWhyASoundCannotBeAdded) {
  const Folder elsewhere;
  const std::string outside = elsewhere.write("horn.wav", "RIFF"),
                    no_sound = folder_.write("page.wav", "text");
  EditedLevel level = opened();
  const auto why = [&](const std::string& file) {
    const auto added = level.add_emitter(file, {1, 1, 1}, {0, 0, 1});
    return added.ok() ? "" : added.error().message;
  };
  EXPECT_THAT(why(outside), HasSubstr("lies outside the level's folder"));
  EXPECT_THAT(why("missing.wav"), HasSubstr("'missing.wav' is not there"));
  EXPECT_THAT(why("page.wav"), HasSubstr("page.wav"));
  EXPECT_FALSE(level.history().can_undo());
}

PortalSpec doorway(const std::string& name, const Vec3& centre_m) {
  PortalSpec spec;
  spec.portal = facing_portal(centre_m, {1, 0, 0}, 0.9, 2);
  spec.portal.name = name;
  spec.material = "wood";
  return spec;
}

TEST_F(EditedLevelTest, ShowsThePortalsThatABakeReads) {
  folder_.write("box.acoustics.json", R"({"portals": [
    {"name": "hatch", "at": [1, 2, 1], "size": [1, 1], "facing": [0, 1, 0], "comment": "kept"}]})");
  EditedLevel level = opened();
  ASSERT_EQ(level.now().portals.size(), 1u);
  const std::size_t added = level.add_portal(doorway("gate", {2, 1, 2.5}));
  PortalSpec wide = level.now().portals[added];
  wide.portal = facing_portal({2, 1, 2}, {0, 0, -1}, 1.2, 2.1);
  wide.portal.name = "wide gate";
  wide.portal.is_baked_closed = true;
  wide.material = "brick";
  level.set_portal(added, wide);
  PortalSpec hatch = level.now().portals[0];
  hatch.portal.centre_m.x = 1.5;
  level.set_portal(0, hatch);
  ASSERT_TRUE(level.autosave().ok());

  const Level read_back = baked(level);
  ASSERT_EQ(read_back.portals.size(), 2u);
  for (std::size_t i = 0; i < 2; ++i) {
    const Portal& shown = level.now().portals[i].portal;
    EXPECT_EQ(read_back.portals[i].name, shown.name);
    EXPECT_EQ(read_back.portals[i].is_baked_closed, shown.is_baked_closed);
    for (const auto member : {&Portal::centre_m, &Portal::half_u_m, &Portal::half_v_m})
      EXPECT_LT(length(read_back.portals[i].*member - shown.*member), 1e-4);
  }
  EXPECT_EQ(read_back.materials[read_back.portal_materials[1]].name, "brick");
  ASSERT_TRUE(level.save().ok());
  EXPECT_THAT(sidecar(), HasSubstr("\"kept\""));
}

TEST_F(EditedLevelTest, UndoesEditsOfPortals) {
  EditedLevel level = opened();
  const std::string first = level.sidecar_text();
  level.add_portal(doorway("gate", {2, 1, 2.5}));
  EXPECT_EQ(level.history().to_undo(), "add portal gate");
  for (const double x : {2.1, 2.2, 2.3}) level.set_portal(0, doorway("gate", {x, 1, 2.5}), 7);
  level.remove_portal(0);
  EXPECT_TRUE(level.now().portals.empty());
  EXPECT_EQ(level.sidecar_text(), first) << "nothing of it is left";
  level.undo();
  EXPECT_EQ(level.now().portals[0].portal.centre_m.x, 2.3);
  level.undo();
  EXPECT_EQ(level.now().portals[0].portal.centre_m.x, 2) << "a gesture is one step";
  level.undo();
  EXPECT_TRUE(level.is_saved());
  level.redo();
  EXPECT_EQ(level.now().portals.size(), 1u);
}

// A portal beside the door, which its place does not couple with it.
TEST_F(EditedLevelTest, ChoosesThePartsThatOpenAPortal) {
  path_ = door_level(folder_);
  folder_.write("rooms.acoustics.json", R"({"movable": ["Door"], "emitters": [
    {"name": "hiss", "signal": "noise", "at": [2, 1.5, 1.2]}]})");
  EditedLevel level = opened();
  PortalSpec spec = doorway("gate", {2, 1, 2.5});
  level.add_portal(spec);
  ASSERT_TRUE(level.autosave().ok());
  EXPECT_TRUE(baked(level).portals[0].parts.empty());
  spec.parts = {{"Door"}};
  level.set_portal(0, spec);
  EXPECT_THAT(level.sidecar_text(), HasSubstr(R"("parts":["Door"])"));
  ASSERT_TRUE(level.autosave().ok());
  EXPECT_EQ(baked(level).portals[0].parts, std::vector<std::uint16_t>{0});
  spec.parts = std::nullopt;
  level.set_portal(0, spec);
  EXPECT_THAT(level.sidecar_text(), ::testing::Not(HasSubstr("parts")));
  level.undo();
  EXPECT_EQ(level.now().portals[0].parts, (PartPatterns{{"Door"}}));
}

TEST_F(EditedLevelTest, MakesADoorOfANodeAndASurfaceOfItAgain) {
  path_ = door_level(folder_);
  EditedLevel level = opened();
  const std::size_t triangles = level.mesh().triangles.size();
  ASSERT_EQ(level.now().nodes.size(), 2u);
  EXPECT_EQ(level.now().nodes[1].nodes, std::vector<std::string>{"Door"});
  EXPECT_TRUE(level.parts().empty());
  ASSERT_TRUE(level.set_movable("Door", true).ok());
  ASSERT_EQ(level.parts().size(), 1u);
  EXPECT_EQ(level.mesh().triangles.size(), triangles - 12);
  EXPECT_EQ(level.why_movable_fixed("Door"), "");
  EXPECT_EQ(baked(level).movable_parts, level.parts());
  level.undo();
  EXPECT_TRUE(level.parts().empty());
  EXPECT_EQ(level.mesh().triangles.size(), triangles);
  level.redo();
  ASSERT_TRUE(level.set_movable("Door", false).ok());
  EXPECT_TRUE(level.parts().empty());
  EXPECT_TRUE(level.is_saved());
  EXPECT_FALSE(level.set_movable("", true).ok());
}

}  // namespace
}  // namespace clamor::testing
