// bake_library_errors_test.cpp: the C interface of the bake with arguments and files that are
// wrong.
#include <array>
#include <cmath>
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "bake/clamor_bake.h"
#include "tests/library/bake_library_box.h"

namespace clamor {
namespace {

namespace fs = std::filesystem;
using testing::BakedLevel;
using testing::bytes_of;
using testing::few_photons;
using ::testing::HasSubstr;
using testing::in_memory;
using testing::kCorners_m;
using testing::kWalls;

using BakeLibraryErrors = testing::BakeLibraryTest;

TEST_F(BakeLibraryErrors, SaysWhyItCannotBakeAndLeavesNoFile) {
  const std::string path = box_file(), out = folder_ + "/out.clamor";
  const std::string nowhere = folder_ + "/none/out.clamor";
  const BakedLevel level = read(path);
  clamor_bake_level* made = nullptr;
  ASSERT_EQ(clamor_bake_create_level(nullptr, &made, nullptr), CLAMOR_BAKE_OK);
  const BakedLevel empty(made);
  const std::string no_journal = write("notes.txt", "these are no photons");
  const auto before = files();
  const auto refused = [&](const BakedLevel& of, const std::string& into, int code,
                           const char* says, auto set) {
    clamor_bake_options options = few_photons();
    set(options);
    clamor_bake_error error;
    EXPECT_EQ(clamor_bake_to_file(of.get(), &options, into.c_str(), nullptr, &error), code);
    EXPECT_EQ(error.code, code);
    EXPECT_THAT(std::string(error.sentence), HasSubstr(says));
    EXPECT_EQ(files(), before) << says;
  };
  const auto plain = [](clamor_bake_options&) {};
  refused(nullptr, out, CLAMOR_BAKE_ERROR_ARGUMENT, "null", plain);
  refused(level, "", CLAMOR_BAKE_ERROR_ARGUMENT, "name a file", plain);
  refused(level, nowhere, CLAMOR_BAKE_ERROR_FILE, "does not exist", plain);
  refused(level, "/dev/null", CLAMOR_BAKE_ERROR_FILE, "device", plain);
  refused(level, path, CLAMOR_BAKE_ERROR_FILE, "cannot be written", plain);
  refused(level, folder_ + "/tone.wav", CLAMOR_BAKE_ERROR_FILE, "cannot be written", plain);
  refused(empty, out, CLAMOR_BAKE_ERROR_LEVEL, "no emitter", plain);
  refused(level, out, CLAMOR_BAKE_ERROR_ARGUMENT, "clamor_bake_options.bytes is 3",
          [](auto& o) { o.bytes = 3; });
  refused(level, out, CLAMOR_BAKE_ERROR_ARGUMENT, "threads", [](auto& o) { o.threads = 1025; });
  refused(level, out, CLAMOR_BAKE_ERROR_ARGUMENT, "photons", [](auto& o) { o.photons = ~0ull; });
  refused(level, out, CLAMOR_BAKE_ERROR_ARGUMENT, "goal", [](auto& o) { o.goal_s = 1; });
  refused(level, out, CLAMOR_BAKE_ERROR_ARGUMENT, "early_order",
          [](auto& o) { o.has_early_order = 1, o.early_order = 4; });
  refused(level, out, CLAMOR_BAKE_ERROR_ARGUMENT, "probe_spacing_m",
          [](auto& o) { o.probe_spacing_m = -2; });
  refused(level, out, CLAMOR_BAKE_ERROR_ARGUMENT, "simplify_m",
          [](auto& o) { o.simplify_m = std::nan(""); });
  refused(level, out, CLAMOR_BAKE_ERROR_MEMORY, "1 MB", [](auto& o) { o.memory_bytes = 1e6; });
  refused(level, out, CLAMOR_BAKE_ERROR_FILE, "notes.txt",
          [&](auto& o) { o.journal = no_journal.c_str(); });
  write("box.acoustics.json", "{}");
  refused(level, out, CLAMOR_BAKE_ERROR_FILE, "changed during the bake", plain);
}

TEST_F(BakeLibraryErrors, TreatsWarningsAsErrorsWhereThatIsAsked) {
  const BakedLevel level = box_of_triangles();
  clamor_bake_emitter outside{};
  outside.bytes = sizeof(outside);
  outside.name = "outside";
  outside.position_m[0] = 30;
  ASSERT_EQ(clamor_bake_add_emitter(level.get(), &outside, nullptr), CLAMOR_BAKE_OK);
  clamor_bake_options options = few_photons();
  options.strict = 1;
  clamor_bake_error error;
  const std::string out = folder_ + "/out.clamor";
  EXPECT_EQ(clamor_bake_to_file(level.get(), &options, out.c_str(), nullptr, &error),
            CLAMOR_BAKE_ERROR_WARNINGS);
  EXPECT_THAT(std::string(error.sentence), HasSubstr("'outside'"));
  EXPECT_FALSE(fs::exists(out));
}

TEST_F(BakeLibraryErrors, RefusesWrongPartsOfALevelWithASentence) {
  const BakedLevel level = box_of_triangles();
  clamor_bake_level* const made = level.get();
  clamor_bake_error error;
  const auto says = [&](clamor_bake_result result, int code, const char* sentence) {
    EXPECT_EQ(result, code) << sentence;
    EXPECT_EQ(error.code, code);
    EXPECT_THAT(std::string(error.sentence), HasSubstr(sentence));
  };
  uint32_t number = 0;
  clamor_bake_material material{};
  material.bytes = sizeof(material);
  says(clamor_bake_add_material(made, &material, &number, &error), CLAMOR_BAKE_ERROR_ARGUMENT,
       "neither a preset nor an absorption");
  material.preset = "bricc";
  says(clamor_bake_add_material(made, &material, &number, &error), CLAMOR_BAKE_ERROR_ARGUMENT,
       "brick");
  material.preset = "brick";
  const std::array<float, 8> high = {0, 0, 0, 0, 0, 0, 0, 1.5f}, all = {1, 1, 1, 1, 1, 1, 1, 1};
  material.absorption = high.data();
  says(clamor_bake_add_material(made, &material, &number, &error), CLAMOR_BAKE_ERROR_ARGUMENT,
       "absorption is 1.5");
  material.absorption = nullptr;
  material.transmission = all.data();
  says(clamor_bake_add_material(made, &material, &number, &error), CLAMOR_BAKE_ERROR_ARGUMENT,
       "transmits more than it absorbs");

  std::vector<float> corners = kCorners_m;
  says(clamor_bake_add_triangles(made, corners.data(), 8, kWalls.data(), 12, 9, &error),
       CLAMOR_BAKE_ERROR_ARGUMENT, "no material 9");
  says(clamor_bake_add_triangles(made, corners.data(), 7, kWalls.data(), 12, 0, &error),
       CLAMOR_BAKE_ERROR_ARGUMENT, "there are 7 vertices");
  says(clamor_bake_add_triangles(made, corners.data(), 8, nullptr, 3, 0, &error),
       CLAMOR_BAKE_ERROR_ARGUMENT, "three vertices");
  corners[5] = std::nanf("");
  says(clamor_bake_add_triangles(made, corners.data(), 8, kWalls.data(), 12, 0, &error),
       CLAMOR_BAKE_ERROR_ARGUMENT, "vertex 1 is not finite");

  clamor_bake_sound sound{};
  sound.bytes = sizeof(sound);
  says(clamor_bake_add_sound(made, &sound, &number, &error), CLAMOR_BAKE_ERROR_ARGUMENT,
       "either a path or samples");
  sound.path = "/nowhere/violin.flac";
  says(clamor_bake_add_sound(made, &sound, &number, &error), CLAMOR_BAKE_ERROR_FILE,
       "/nowhere/violin.flac");
  sound.path = nullptr;
  sound.samples = corners.data();
  sound.frames = corners.size();
  says(clamor_bake_add_sound(made, &sound, &number, &error), CLAMOR_BAKE_ERROR_ARGUMENT,
       "no finite numbers");

  clamor_bake_emitter emitter{};
  emitter.bytes = sizeof(emitter);
  emitter.name = "one";
  says(clamor_bake_add_emitter(made, &emitter, &error), CLAMOR_BAKE_ERROR_ARGUMENT,
       "another emitter is named 'one'");
  emitter.name = "two";
  emitter.sound = 5;
  says(clamor_bake_add_emitter(made, &emitter, &error), CLAMOR_BAKE_ERROR_ARGUMENT, "no sound 5");
  emitter.sound = 0;
  emitter.directivity = -1;
  says(clamor_bake_add_emitter(made, &emitter, &error), CLAMOR_BAKE_ERROR_ARGUMENT, "directivity");

  clamor_bake_level* none = made;
  says(clamor_bake_read_level("/nowhere/hall.glb", nullptr, &none, &error), CLAMOR_BAKE_ERROR_FILE,
       "/nowhere/hall.glb");
  EXPECT_EQ(none, nullptr);
  clamor_bake_destroy_level(nullptr);
  clamor_bake_free(nullptr);

  // The level is as it was before.
  EXPECT_TRUE(in_memory(level, few_photons()) == in_memory(box_of_triangles(), few_photons()));
}

}  // namespace
}  // namespace clamor
