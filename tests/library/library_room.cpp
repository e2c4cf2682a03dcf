#include "tests/library/library_room.h"

#include <functional>
#include <utility>
#include <vector>

#include "bake/bake.h"
#include "formats/bake_file/bake_contents.h"
#include "formats/bake_file/bake_writer.h"
#include "tests/baked_room.h"
#include "tests/rooms.h"
#include "tests/temporary_file.h"

namespace clamor::testing {

namespace {

void write(const TemporaryFile& file, const std::function<void(BakeContents&)>& change) {
  // A portal divides the room.
  BakeContents contents = baked_contents(300, {{"Door", {3, 4, 1.5}, {0, 4, 0}, {0, 0, 1.5}}});
  change(contents);
  EXPECT_TRUE(write_bake(file.path(), contents, 1).ok());
}

}  // namespace

const std::string& room() {
  static const TemporaryFile file(".clamor");
  static const bool once = (write(file, [](BakeContents&) {}), true);
  (void)once;
  return file.path();
}

const std::string& room_with_cage() {
  static const TemporaryFile file(".clamor");
  static const bool once =
      (write(file,
             [](BakeContents& contents) {
               contents.movable_parts = {{"cage", box_mesh({0.5, 0.5, 0.5}, 0), {{100, 0, 0}}}};
             }),
       true);
  (void)once;
  return file.path();
}

const std::string& rooms_with_door() {
  static const TemporaryFile file(".clamor");
  static const bool once = [] {
    Level level = shoebox({8, 4, 9}, uniform_material(0.2f, 0.5f, 8), {});
    level.emitters.clear();
    level.signals.clear();
    for (const auto& [from_m, to_m] : {std::pair{0.0f, 3.4f}, std::pair{4.6f, 8.0f}})
      add_quad(level.mesh,
               {Vec3f(from_m, 0, 4.5f), {to_m, 0, 4.5f}, {to_m, 4, 4.5f}, {from_m, 4, 4.5f}});
    level.portals = {{"Door", {4, 2, 4.5}, {0.6, 0, 0}, {0, 2, 0}}};
    Mesh leaf = box_mesh({0.6, 2, 0.02}, 0);
    for (Vec3f& vertex : leaf.vertices_m) vertex += Vec3f(0.6f, 2, 0);
    level.movable_parts = {{"Door", leaf, {{3.4, 0, 4.5}}}};
    BakeOptions options;
    options.settings.photons = 4000;
    options.probe_sources = 200;
    for (const double z_m : {1.5, 3.0, 6.0, 7.5}) options.probes_m.push_back({2, 1.5, z_m});
    const auto contents = bake(level, options);
    EXPECT_TRUE(contents.ok());
    EXPECT_TRUE(write_bake(file.path(), *contents, 1).ok());
    return true;
  }();
  (void)once;
  return file.path();
}

const std::string& room_without_walls() {
  static const TemporaryFile file(".clamor");
  static const bool once = (write(file, [](BakeContents& contents) { contents.mesh = {}; }), true);
  (void)once;
  return file.path();
}

const std::string& silent_field() {
  static const TemporaryFile file(".clamor");
  static const bool once =
      (write(file,
             [](BakeContents& contents) {
               contents.mesh = {};
               contents.signals.assign(3, {"silence", std::vector<float>(4800), true});
             }),
       true);
  (void)once;
  return file.path();
}

}  // namespace clamor::testing
