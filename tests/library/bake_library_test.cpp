// bake_library_test.cpp: the C interface of the bake as an application uses it, against the
// program.
#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <string>
#include <thread>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "bake/clamor_bake.h"
#include "formats/bake_file/bake_file.h"
#include "tests/library/bake_library_box.h"
#include "tests/temporary_file.h"

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
using testing::without_root;

using BakeLibrary = testing::BakeLibraryTest;

TEST_F(BakeLibrary, WritesTheBytesOfTheCommandToAFileAndIntoMemory_NoAsan) {
  const std::string path = box_file(), out = folder_ + "/library.clamor";
  const BakedLevel level = read(path);
  struct Case {
    std::string words;
    void (*set)(clamor_bake_options&);
  };
  const std::vector<Case> cases = {
      {"--photons 1000 --sources 1000", [](auto&) {}},
      {"--photons 1000 --sources 1000 --seed 7 --threads 1",  // another seed, other random delays
       [](auto& options) { options.seed = 7, options.threads = 1; }},
      {"--photons 1000 --sources 1000 --simplify 0.05 --instances off --kappa 0.3 --longest 0.5",
       [](auto& options) {
         options.simplify_m = 0.05, options.no_instances = 1;
         options.roulette_exponent = 0.3, options.longest_path_s = 0.5;
       }},
      {"--photons 1000 --sources 1000 --early-order 0",
       [](auto& options) { options.has_early_order = 1; }},
      {"--photons 1000 --sources 1000 --early-order 1",
       [](auto& options) { options.has_early_order = options.early_order = 1; }},
      {"--photons 1000 --sources 1000 --probes auto",
       [](auto& options) { options.probe_spacing_m = -1; }},
      {"--photons 1000 --sources 1000 --probes 1.5",
       [](auto& options) { options.probe_spacing_m = 1.5; }},
      {"--until 20dB",
       [](auto& options) { options.photons = options.sources = 0, options.goal_error_db = 20; }}};
  for (const Case& one : cases) {
    clamor_bake_options options = few_photons();
    one.set(options);
    const std::string expected = bytes_of_command(path, one.words);
    clamor_bake_error error;
    ASSERT_EQ(clamor_bake_to_file(level.get(), &options, out.c_str(), nullptr, &error),
              CLAMOR_BAKE_OK)
        << error.sentence;
    EXPECT_TRUE(bytes_of(out) == expected) << one.words;
    EXPECT_TRUE(in_memory(level, options) == expected) << one.words;
  }
}

TEST_F(BakeLibrary, TakesOptionsOfAnOlderVersionAsTheyWereMeant) {
  const BakedLevel level = box_of_triangles();
  const std::string by_default = in_memory(level, few_photons());
  clamor_bake_options options = few_photons();
  options.early_order = 1;  // has no effect without has_early_order
  EXPECT_TRUE(in_memory(level, options) == by_default);
  options.has_early_order = 1;
  EXPECT_FALSE(in_memory(level, options) == by_default);
  options.bytes = offsetof(clamor_bake_options, has_early_order);
  EXPECT_TRUE(in_memory(level, options) == by_default);
}

TEST_F(BakeLibrary, ReadsALevelWithTheOptionsOfTheCommand_NoAsan) {
  const std::string path = box_file(), sidecar = write("other.json", R"({"emitters": []})");
  const std::string three = "name=three,signal=impulse,at=1,1,1";
  const std::array<const char*, 1> emitters = {three.c_str()};
  clamor_bake_level_options options{};
  options.bytes = sizeof(options);
  options.acoustics = sidecar.c_str();
  options.material = "concrete";
  options.emitters = emitters.data();
  options.emitter_count = emitters.size();
  const BakedLevel level = read(path, &options);
  EXPECT_TRUE(
      in_memory(level, few_photons()) ==
      bytes_of_command(path, "--photons 1000 --sources 1000 --material concrete --acoustics " +
                                 sidecar + " --emitter " + three));
}

TEST_F(BakeLibrary, BakesALevelWithProbesAlone_NoAsan) {
  const std::string path = box_file();
  write("box.acoustics.json", R"({"probes": [{"at": [2, 1.5, 3]}]})");
  const std::string baked = in_memory(read(path), few_photons());
  EXPECT_TRUE(baked == bytes_of_command(path, "--photons 1000 --sources 1000"));
  const testing::TemporaryFile kept(".clamor", baked);
  const auto opened = testing::opened(kept);
  EXPECT_TRUE(opened->emitters().empty());
  EXPECT_EQ(opened->probes().places.size(), 1u);
}

TEST_F(BakeLibrary, BakesTrianglesLikeAFileWithTheSameTriangles) {
  const std::string path = box_file();
  write("box.acoustics.json",
        R"({"emitters": [{"name": "one", "signal": "noise", "at": [2, 1.5, 3], "gain": 0.5}]})");
  const BakedLevel made = box_of_triangles();
  clamor_bake_level_info info{};
  info.bytes = sizeof(info);
  ASSERT_EQ(clamor_bake_get_level_info(made.get(), &info), CLAMOR_BAKE_OK);
  EXPECT_EQ(info.triangles, 12u);
  EXPECT_EQ(info.high_m[2], 8);
  const std::string triangles = in_memory(made, few_photons());
  const std::string file = in_memory(read(path), few_photons());
  EXPECT_TRUE(without_root(triangles) == without_root(file));
  EXPECT_FALSE(triangles == file) << "they came from different inputs, which the root lists";

  const testing::TemporaryFile kept(".clamor", triangles);
  const auto opened = testing::opened(kept);
  EXPECT_EQ(opened->emitters()[0].name, "one");
  EXPECT_EQ(opened->materials()[0].name, "mineral_wool");
  EXPECT_THAT(opened->provenance().tool, HasSubstr("libclamor_bake"));
  EXPECT_EQ(opened->provenance().level, "box.gltf");
}

TEST_F(BakeLibrary, TakesSamplesOfAnyRateLikeASoundFile) {
  write("other.wav", testing::wav(22050, 44100));
  std::vector<float> samples;
  const std::string file = testing::wav(22050, 44100);
  for (std::size_t at = 44; at < file.size(); at += 2) {
    std::int16_t sample = 0;
    std::memcpy(&sample, &file[at], 2);
    samples.push_back(static_cast<float>(sample) / 32768);
  }
  std::vector<std::string> baked;
  for (const bool from_file : {true, false}) {
    const BakedLevel level = box_of_triangles();
    const std::string path = folder_ + "/other.wav";
    clamor_bake_sound sound{};
    sound.bytes = sizeof(sound);
    sound.name = "other.wav";
    if (from_file) {
      sound.path = path.c_str();
    } else {
      sound.samples = samples.data();
      sound.frames = samples.size();
      sound.rate_hz = 44100;
    }
    clamor_bake_emitter emitter{};
    emitter.bytes = sizeof(emitter);
    emitter.position_m[0] = emitter.position_m[1] = emitter.position_m[2] = 1;
    clamor_bake_error error;
    EXPECT_EQ(clamor_bake_add_sound(level.get(), &sound, &emitter.sound, &error), CLAMOR_BAKE_OK)
        << error.sentence;
    EXPECT_EQ(clamor_bake_add_emitter(level.get(), &emitter, &error), CLAMOR_BAKE_OK)
        << error.sentence;
    baked.push_back(without_root(in_memory(level, few_photons())));
  }
  EXPECT_TRUE(baked[0] == baked[1]);
}

struct Heard {
  std::thread::id thread = std::this_thread::get_id();
  uint32_t cancel_in_phase = 99;
  std::vector<double> fractions;
  std::vector<std::string> warnings, notes;
};

int32_t hear(void* user, const clamor_bake_progress* progress) {
  auto& heard = *static_cast<Heard*>(user);
  EXPECT_EQ(heard.thread, std::this_thread::get_id());
  heard.fractions.push_back(progress->fraction);
  return progress->phase >= heard.cancel_in_phase;
}

void keep(void* user, uint32_t kind, const char* sentence) {
  auto& heard = *static_cast<Heard*>(user);
  EXPECT_EQ(heard.thread, std::this_thread::get_id());
  (kind == CLAMOR_BAKE_WARNING ? heard.warnings : heard.notes).emplace_back(sentence);
}

TEST_F(BakeLibrary, TellsItsProgressAndItsReportOnTheCallingThread) {
  const BakedLevel level = box_of_triangles();
  Heard heard;
  clamor_bake_options options = few_photons();
  options.user = &heard;
  options.progress = hear;
  options.message = keep;
  clamor_bake_report report{};
  report.bytes = sizeof(report);
  const std::string out = folder_ + "/out.clamor";
  ASSERT_EQ(clamor_bake_to_file(level.get(), &options, out.c_str(), &report, nullptr),
            CLAMOR_BAKE_OK);
  EXPECT_FALSE(heard.fractions.empty());
  EXPECT_TRUE(std::is_sorted(heard.fractions.begin(), heard.fractions.end()));
  EXPECT_EQ(heard.fractions.back(), 1);
  EXPECT_EQ(heard.warnings.size(), report.warnings);
  EXPECT_THAT(heard.notes, ::testing::Contains(HasSubstr("12 triangles")));
  EXPECT_EQ(report.photons, 1000u);
  EXPECT_EQ(report.sources, 1001u);
  EXPECT_EQ(report.file_bytes, fs::file_size(out));
  EXPECT_GT(report.t30_s[4], 0);
}

TEST_F(BakeLibrary, ThatIsCancelledLeavesNoFileAndAnOlderOneAsItWas) {
  const BakedLevel level = read(box_file());
  const std::string older = write("older.clamor", "older");
  const auto before = files();
  for (const uint32_t phase : {CLAMOR_BAKE_PREPARING, CLAMOR_BAKE_TRACING}) {
    Heard heard;
    heard.cancel_in_phase = phase;
    clamor_bake_options options = few_photons();
    options.photons = 1'000'000'000;  // hours
    options.user = &heard;
    options.progress = hear;
    for (const std::string& path : {older, folder_ + "/new.clamor"}) {
      clamor_bake_error error;
      EXPECT_EQ(clamor_bake_to_file(level.get(), &options, path.c_str(), nullptr, &error),
                CLAMOR_BAKE_ERROR_CANCELLED);
      EXPECT_EQ(error.code, CLAMOR_BAKE_ERROR_CANCELLED);
      EXPECT_THAT(std::string(error.sentence), HasSubstr("cancelled"));
    }
  }
  EXPECT_EQ(files(), before);
  EXPECT_EQ(bytes_of(older), "older");
}

TEST_F(BakeLibrary, ContinuesFromAJournal) {
  const BakedLevel level = read(box_file());
  const std::string journal = folder_ + "/kept.journal", out = folder_ + "/out.clamor";
  clamor_bake_options options = few_photons();
  const std::string expected = in_memory(level, options);
  options.journal = journal.c_str();
  for (const uint64_t reused : {0, 1000}) {
    clamor_bake_report report{};
    report.bytes = sizeof(report);
    clamor_bake_error error;
    ASSERT_EQ(clamor_bake_to_file(level.get(), &options, out.c_str(), &report, &error),
              CLAMOR_BAKE_OK)
        << error.sentence;
    EXPECT_EQ(report.photons_reused, reused);
    EXPECT_TRUE(bytes_of(out) == expected);
  }
}

}  // namespace
}  // namespace clamor
