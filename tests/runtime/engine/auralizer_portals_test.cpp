// auralizer_portals_test.cpp: how loud what came through a portal is.
#include <cmath>
#include <filesystem>
#include <fstream>

#include <gtest/gtest.h>

#include "bake/octree/octree_builder.h"
#include "common/random.h"
#include "formats/bake_file/expanded_sources.h"
#include "runtime/engine/auralizer.h"
#include "runtime/engine/auralizer_input.h"
#include "runtime/engine/auralizer_options.h"
#include "runtime/response/energy_response.h"
#include "runtime/sampling/moving_script.h"
#include "runtime/voices/keyframe.h"
#include "tests/portal_rooms.h"
#include "tests/temporary_file.h"
#include "tools/analysis/click_detector.h"

namespace clamor {
namespace {

using testing::as_file;
using testing::baked_portal_rooms;

const Listener kInFarRoom{{9, 1.5, 2}, 0, 0}, kInFirstRoom{{4.5, 1.5, 3.8}, 0, 0};

// Only the reflections whose sets `wanted` accepts.
template <class Wanted>
std::shared_ptr<const BakeFile> part_of(BakeContents contents, const Wanted& wanted) {
  std::vector<Source> part;
  for (const Source& source : contents.octree.sources)
    if (!source.is_emitter && wanted(source)) part.push_back(source);
  contents.octree = build_octree(std::move(part));
  contents.statistics = {};
  return as_file(contents);
}

// The reflections of the far room, all of which came through the door.
std::shared_ptr<const BakeFile> far_room() {
  static const auto kFile = part_of(baked_portal_rooms(true, 500), [](const Source& source) {
    return source.position_m.x > testing::kPortalWall_m + 0.01f;
  });
  return kFile;
}

AuralizerOptions options_with(int voices) {
  AuralizerOptions options;
  options.voices = voices;
  options.wait_for_pages = true;
  options.visibility = false;
  return options;
}

std::unique_ptr<Auralizer> auralizer_of(std::shared_ptr<const BakeFile> file,
                                        const AuralizerOptions& options) {
  auto made = Auralizer::create(std::move(file), options);
  EXPECT_TRUE(made.ok()) << made.error().message;
  return std::move(*made);
}

// Reflections of a tone with other polarities would differ by as much as portals do.
Signal noise() {
  Signal signal{"noise", {}, true};
  for (std::uint32_t i = 0; i < kSampleRate_hz; ++i)
    signal.samples.push_back(static_cast<float>(unit(philox(5, {i, 0, 0, 0})[0]) - 0.5));
  return signal;
}

// Both channels of `keyframes` keyframes.
std::vector<float> heard(Auralizer& auralizer, int keyframes,
                         const Listener& listener = kInFarRoom) {
  std::vector<float> all, block(2 * kKeyframeFrames);
  for (int k = 0; k < keyframes; ++k) {
    while (auralizer.wants_keyframe()) auralizer.make_keyframe(listener);
    auralizer.mix(block);
    all.insert(all.end(), block.begin(), block.end());
  }
  return all;
}

double power_of(std::span<const float> samples) {
  double power = 0;
  for (const float sample : samples) power += static_cast<double>(sample) * sample;
  return power;
}

// The power half a second after the portal is set.
double power_at(float openness, int voices,
                const std::shared_ptr<const BakeFile>& file = far_room()) {
  const auto auralizer = auralizer_of(file, options_with(voices));
  (void)heard(*auralizer, 25);
  auralizer->set_portals({openness});
  (void)heard(*auralizer, 25);
  return power_of(heard(*auralizer, 25));
}

TEST(AuralizerPortals, ScaleWhatPassedThem_NoAsan) {
  for (const int voices : {100, 5000}) {
    const double open = power_at(1, voices);
    EXPECT_GT(open, 1e-6);
    EXPECT_NEAR(10 * std::log10(power_at(0.25f, voices) / open), -6.0206, 0.01);
    EXPECT_LT(power_at(0, voices), 1e-12 * open);
  }
}

// The far room, whose door is a part of the portal.
std::shared_ptr<const BakeFile> room_with_door() {
  Level level = testing::portal_rooms();
  Mesh leaf = box_mesh({0.02, 1, 0.45}, 0);
  for (Vec3f& vertex : leaf.vertices_m) vertex += Vec3f(0, 0, 0.45f);
  level.movable_parts = {{"Door", leaf, {{6, 1, 2.05}}}};
  level.portals[0].parts = {0};
  return part_of(
      *bake(level, {.settings = {.photons = 500}, .threads = 2}),
      [](const Source& source) { return source.position_m.x > testing::kPortalWall_m + 0.01f; });
}

// Nothing is left behind a door that stands closed; one that is gone lets everything through, and a
// portal that is set does not ask its door. The far room has no other surface to be hidden by.
TEST(AuralizerPortals, OpenAndCloseWithTheirDoorUntilTheyAreSet) {
  const auto file = room_with_door();
  AuralizerOptions options = options_with(5000);
  options.visibility = true;
  const auto auralizer = auralizer_of(file, options);
  const PartHandle door = auralizer->level_parts().front();
  const auto power = [&] {
    (void)heard(*auralizer, 25);
    return power_of(heard(*auralizer, 25));
  };
  const auto enable = [&](bool enabled) {
    ASSERT_TRUE(auralizer->parts()->enable(door, enabled).ok());
  };
  EXPECT_LT(power(), 1e-12);
  enable(false);
  const double open = power();
  EXPECT_GT(open, 1e-6);
  enable(true);
  EXPECT_LT(power(), 1e-12 * open);
  auralizer->set_portals({1});
  EXPECT_NEAR(10 * std::log10(power() / open), 0, 0.5);
  auralizer->set_portals({kOpenedByParts});
  EXPECT_LT(power(), 1e-12 * open);
}

TEST(AuralizerPortals, LetTheClosedStateSoundAsFarAsTheyAreClosed_NoAsan) {
  Level level = testing::portal_rooms();
  level.portals[0].is_baked_closed = true;
  level.portal_materials = {0};
  const BakeContents contents = *bake(level, {.settings = {.photons = 1000}, .threads = 2});
  const auto file = part_of(contents, [&](const Source& source) {
    return testing::set_of(contents, source).has_state(PortalSet::kStateClosed);
  });
  const double closed = power_at(0, 5000, file);
  EXPECT_GT(closed, 1e-6);
  EXPECT_NEAR(10 * std::log10(power_at(0.75f, 5000, file) / closed), -6.0206, 0.01);
  EXPECT_LT(power_at(1, 5000, file), 1e-12 * closed);
  const auto untouched = auralizer_of(file, options_with(5000));
  EXPECT_LT(power_of(heard(*untouched, 50)), 1e-12 * closed);
}

TEST(AuralizerPortals, SoundAsWithoutPortalsWhenOpen_NoAsan) {
  const auto level_db = [](bool has_portal) {
    const auto file = as_file(baked_portal_rooms(has_portal));
    const auto all = read_expanded_sources(*file);
    EXPECT_TRUE(all.ok());
    double energy = 0;
    for (const Arrival& arrival : energy_response(all->sources, all->emitters, file->materials(),
                                                  Air{}, kInFarRoom.position_m, std::nullopt))
      energy += static_cast<double>(arrival.energy[4]);
    return 10 * std::log10(energy);
  };
  EXPECT_NEAR(level_db(true), level_db(false), 1e-4);
}

TEST(AuralizerPortals, OpenAndCloseWithoutClicks) {
  const auto auralizer = auralizer_of(far_room(), options_with(300));
  (void)heard(*auralizer, 50);
  std::vector<float> left;
  for (int i = 0; i < 6; ++i) {
    auralizer->set_portals({i % 2 == 0 ? 0.0f : 1.0f});
    const auto both = heard(*auralizer, 15);
    for (std::size_t f = 0; f < both.size(); f += 2) left.push_back(both[f]);
  }
  float peak = 0;
  for (const float sample : left) peak = std::max(peak, std::abs(sample));
  for (const Click& click : find_clicks(left, 1e-2 * peak))
    ADD_FAILURE() << click.sigmas << " sigmas at " << click.frame;
}

TEST(AuralizerPortals, FollowAScript) {
  const testing::TemporaryFile path(
      ".json", R"({"portals": [{"name": "Door", "openness": [[0, 1], [0.5, 1], [0.6, 0.5]]}]})");
  auto script = MovingScript::read(path.path());
  ASSERT_TRUE(script.ok()) << script.error().message;
  ASSERT_TRUE(script->portals().find(testing::portal_rooms().portals).ok());
  EXPECT_EQ(script->portals().openness(0.55), std::vector<float>{0.75f});
  AuralizerOptions options = options_with(5000);
  options.moving = script->options(1);
  options.script = std::make_shared<MovingScript>(std::move(*script));
  const auto auralizer = auralizer_of(far_room(), options);
  (void)heard(*auralizer, 12);
  const double open = power_of(heard(*auralizer, 10));
  (void)heard(*auralizer, 28);
  EXPECT_NEAR(10 * std::log10(power_of(heard(*auralizer, 10)) / open), -3.0103, 0.05);
}

TEST(AuralizerPortals, OfAScriptMustExist) {
  const testing::TemporaryFile path(".json",
                                    R"({"portals": [{"name": "Gate", "openness": [[0, 1]]}]})");
  auto script = MovingScript::read(path.path());
  ASSERT_TRUE(script.ok());
  AuralizerOptions options = options_with(100);
  options.script = std::make_shared<MovingScript>(std::move(*script));
  const auto made = Auralizer::create(far_room(), options);
  ASSERT_FALSE(made.ok());
  EXPECT_NE(made.error().message.find("'Gate'"), std::string::npos);
}

TEST(AuralizerPortals, OfAScriptAreChecked) {
  for (const char* portals :
       {"{}", "[{}]", R"([{"name": "Door"}])", R"([{"name": "Door", "openness": []}])",
        R"([{"name": "Door", "openness": [[0, 2]]}])",
        R"([{"name": "Door", "openness": [[1, 1], [0, 1]]}])",
        R"([{"name": "Door", "openness": [[-1, 1]]}])", R"([{"name": "Door", "openness": [1]}])",
        R"([{"name": "Door", "openness": [[0, 1]], "wide": 1}])"}) {
    const testing::TemporaryFile path(".json", std::string("{\"portals\": ") + portals + "}");
    EXPECT_FALSE(MovingScript::read(path.path()).ok()) << portals;
  }
}

// A moving source in the first room, heard through the probes round it by a listener in the other.
TEST(AuralizerPortals, ScaleTheReflectionsOfMovingSources_NoAsan) {
  Level level = testing::portal_rooms();
  level.emitters.clear();
  level.signals = {noise()};
  BakeOptions baking{.settings = {.photons = 1000}, .threads = 2};
  baking.probes_m = {{2, 1.5, 1.2}};
  baking.probe_sources = 1000;
  auto contents = bake(level, baking);
  ASSERT_TRUE(contents.ok()) << contents.error().message;
  const auto file = as_file(*contents);
  const auto power_with = [&](float openness) {
    AuralizerOptions options = options_with(5000);
    options.visibility = true;  // hides the source and the first room
    options.moving.max_sources = 1;
    options.moving.kinds = {{"tone", 0, {}}};
    const auto auralizer = auralizer_of(file, options);
    MovingSource source;
    source.position_m = {2, 1.5, 1.2};
    EXPECT_TRUE(auralizer->moving()->add(source).ok());
    auralizer->moving()->commit();
    auralizer->set_portals({openness});
    (void)heard(*auralizer, 30);
    return power_of(heard(*auralizer, 15));
  };
  const double open = power_with(1);
  EXPECT_GT(open, 0);
  EXPECT_LT(power_with(0), 0.5 * open);
  EXPECT_LT(power_with(0.25f), power_with(0.75f));
}

// Sound that leaves a room with hard walls through its door is lost in the other one. Oracle:
// levels with an open doorway and with a wall in its place.
TEST(AuralizerPortals, FadeTheRoomOfAMovingSourceBetweenBothStates_NoAsan) {
  const auto power_in_room = [](Level level, float openness) {
    level.emitters.clear();
    level.signals = {noise()};
    level.materials = {testing::uniform_material(0.04f), testing::uniform_material(1)};
    level.mesh.materials[2] = level.mesh.materials[3] = 1;  // the end of the far room
    BakeOptions baking{.settings = {.photons = 1000}, .threads = 2};
    baking.probes_m = {{2, 1.5, 1.2}};
    baking.probe_sources = 1000;
    auto contents = bake(level, baking);
    EXPECT_TRUE(contents.ok()) << contents.error().message;
    AuralizerOptions options = options_with(5000);
    options.visibility = true;
    options.moving.max_sources = 1;
    options.moving.kinds = {{"noise", 0, {}}};
    const auto auralizer = auralizer_of(as_file(*contents), options);
    MovingSource source;
    source.position_m = {2, 1.5, 1.2};
    source.gain = same_in_all_bands(0.05f);  // far below the limiter
    EXPECT_TRUE(auralizer->moving()->add(source).ok());
    auralizer->moving()->commit();
    if (!level.portals.empty() && openness < 1) auralizer->set_portals({openness});
    (void)heard(*auralizer, 40, kInFirstRoom);
    return power_of(heard(*auralizer, 25, kInFirstRoom));
  };
  Level both = testing::portal_rooms();
  both.portals[0].is_baked_closed = true;
  both.portal_materials = {0};
  Level closed = testing::portal_rooms(false);
  testing::add_quad(closed.mesh,
                    {Vec3f(6, 0, 2.05), Vec3f(6, 0, 2.95), Vec3f(6, 2, 2.95), Vec3f(6, 2, 2.05)});
  const double open_db = 10 * std::log10(power_in_room(testing::portal_rooms(false), 1));
  const double closed_db = 10 * std::log10(power_in_room(closed, 1));
  EXPECT_GT(closed_db, open_db + 0.6);
  EXPECT_NEAR(10 * std::log10(power_in_room(both, 1)), open_db, 0.25);
  EXPECT_NEAR(10 * std::log10(power_in_room(both, 0)), closed_db, 0.25);
}

}  // namespace
}  // namespace clamor
