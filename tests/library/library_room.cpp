#include "tests/library/library_room.h"

#include <functional>
#include <vector>

#include "formats/bake_file/bake_contents.h"
#include "formats/bake_file/bake_writer.h"
#include "tests/baked_room.h"
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
