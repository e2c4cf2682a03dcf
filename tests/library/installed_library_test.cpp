// installed_library_test.cpp: the installed library as an application's build finds it: by CMake
// and by pkg-config, with GCC and with clang, in C and in C++.
#include "tests/library/installed_library.h"

#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <map>
#include <sstream>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "formats/audio/audio_file.h"
#include "tests/build_paths.h"
#include "tests/library/binding_run.h"
#include "tests/shell.h"

namespace clamor {
namespace {

namespace fs = std::filesystem;
using testing::has;
using testing::InstalledLibrary;
using testing::room;
using testing::room_without_walls;
using testing::run;

TEST_P(InstalledLibrary, IsFoundByCMakeAndRunsTheExamples_NoAsan) {
  const std::string compiler = GetParam();
  if (!has(compiler)) GTEST_SKIP() << "not on this machine: " << compiler;
  const std::string built = build(examples(), "examples", compiler);
  if (compiler == "gcc") {
    EXPECT_THAT(run(built + "/turn_around " + room() + " 3 4 1.5"),
                ::testing::HasSubstr("turned 270 to 360 degrees: left"));
    // The source passes from left to right, and nothing else is heard.
    std::istringstream seconds(run(built + "/pass_by " + room() + " 3 4 1.5"));
    std::vector<double> right_over_left_db;
    for (std::string line; std::getline(seconds, line);) {
      double left_db = 0, right_db = 0;
      ASSERT_EQ(
          std::sscanf(line.c_str(), "second %*d: left %lf dB, right %lf dB", &left_db, &right_db),
          2);
      right_over_left_db.push_back(right_db - left_db);
    }
    ASSERT_EQ(right_over_left_db.size(), 4u);
    EXPECT_LT(right_over_left_db[0], -3);
    EXPECT_GT(right_over_left_db[3], 3);
  } else {
    EXPECT_THAT(run(built + "/start_up " + libraries() + "/libclamor.so " + room()),
                ::testing::HasSubstr("first listener, binaural"));
  }
}

INSTANTIATE_TEST_SUITE_P(Compilers, InstalledLibrary, ::testing::Values("gcc", "clang"));

using PackagedLibrary = InstalledLibrary;

TEST_F(PackagedLibrary, IsFoundByPkgConfig_NoAsan) {
  if (!has("pkg-config")) GTEST_SKIP() << "not on this machine: pkg-config";
  const std::string program = prefix_ + "/by_pkg_config";
  run("cc -std=c99 " + examples() + "/play_to_wav.c -o " + program + by_pkg_config("clamor"));
  run("LD_LIBRARY_PATH=" + libraries() + " " + program + "; test $? -eq 2");  // its usage
}

// What the page's games and play_to_wav play.
const Sound& sound_of_the_program() {
  static const Sound sound = [] {
    const testing::TemporaryFile wav(".wav");
    run(std::string(testing::kProgram) + " render " + room_without_walls() + " -o " + wav.path() +
        " --listener 0,1.7,3 --seconds 0.5");
    auto read = read_channels(wav.path(), 2);
    EXPECT_TRUE(read.ok());
    return read.ok() ? std::move(*read) : Sound{};
  }();
  return sound;
}

void expect_the_programs_sound(const std::string& wav) {
  const auto played = read_channels(wav, 2);
  ASSERT_TRUE(played.ok());
  EXPECT_EQ(played->frames(), 24'000u);
  EXPECT_GT(*std::ranges::max_element(played->channels[0]), 0.001f);
  EXPECT_EQ(played->channels, sound_of_the_program().channels);
}

// Does what the page says in an empty folder, where ~/clamor is the installed tree.
void expect_sound_from_an_empty_folder(const std::string& prefix, const std::string& commands,
                                       const std::map<std::string, std::string>& files) {
  std::size_t lines = testing::line_count(commands);
  const testing::EmptyFolder home;
  fs::create_symlink(prefix, home / "clamor");
  fs::create_directory(home / "game");
  for (const auto& [name, text] : files) {
    std::ofstream(home / ("game/" + name)) << text;
    lines += testing::line_count(text);
  }
  EXPECT_LE(lines, 30u);
  fs::copy_file(room_without_walls(), home / "game/room.clamor");
  const testing::TemporaryFile script(".sh", commands);
  run("cd " + (home / "game") + " && HOME=" + home.path() + " CFLAGS=-O0 sh -e " + script.path());
  expect_the_programs_sound(home / "game/room.wav");
}

const std::string kPage = "runtime/README.md";

TEST_F(PackagedLibrary, TakesThirtyLinesOfCToPlayTheSamplesOfTheProgram_NoAsan) {
  expect_sound_from_an_empty_folder(prefix_, testing::example_of(kPage, "sh", "`game.c`"),
                                    {{"game.c", testing::example_of(kPage, "c")},
                                     {"CMakeLists.txt", testing::example_of(kPage, "cmake")}});
}

TEST_F(PackagedLibrary, TakesThirtyLinesOfCppToPlayTheSamplesOfTheProgram_NoAsan) {
  if (!has("pkg-config")) GTEST_SKIP() << "not on this machine: pkg-config";
  expect_sound_from_an_empty_folder(prefix_, testing::example_of(kPage, "sh", "`game.cpp`"),
                                    {{"game.cpp", testing::example_of(kPage, "cpp")}});
}

// The installed package finds the libraries of its own tree.
TEST_F(PackagedLibrary, TakesThirtyLinesOfPythonToImpulseResponsesAndSound_NoAsan) {
  if (std::system("PATH=/usr/bin:$PATH python3 -c 'import numpy' 2>/dev/null") != 0)
    GTEST_SKIP() << "not on this machine: Python 3 with numpy";
  const std::string page = "runtime/bindings/python/README.md";
  const testing::EmptyFolder home;
  fs::create_symlink(prefix_, home / "clamor");
  const std::string code = testing::example_of(page, "python");
  const std::string commands = testing::example_of(page, "sh");
  EXPECT_LE(testing::line_count(code) + testing::line_count(commands), 30u);
  std::ofstream(home / "impulses.py") << code;
  const testing::TemporaryFile script(".sh", commands);
  EXPECT_THAT(run("cd " + home.path() + " && env -u CLAMOR_LIBRARY -u LD_LIBRARY_PATH HOME=" +
                  home.path() + " PATH=/usr/bin:$PATH sh -e " + script.path()),
              ::testing::StartsWith("(9, 24000) peaks: "));
  EXPECT_GT(fs::file_size(home / "walk.wav"), 48'000u * 2 * sizeof(float));
}

// A client that links libclamor.a needs no libclamor.so, and its own names cannot clash.
TEST_F(PackagedLibrary, IsAlsoAnArchive_NoAsan) {
  if (!has("pkg-config")) GTEST_SKIP() << "not on this machine: pkg-config";
  const std::string program = prefix_ + "/with_archive";
  run("cc -std=c99 " + examples() + "/play_to_wav.c -o " + program + " $(PKG_CONFIG_PATH=" +
      libraries() + "/pkgconfig pkg-config --static --cflags --libs clamor | " +
      "sed 's/-lclamor /-l:libclamor.a /')");
  EXPECT_THAT(run("objdump -p " + program), ::testing::Not(::testing::HasSubstr("libclamor.so")));
  run(program + " " + room_without_walls() + " " + prefix_ + "/archive.wav 0.5 0 1.7 3");
  expect_the_programs_sound(prefix_ + "/archive.wav");
  run("! nm -g --defined-only " + libraries() + "/libclamor.a | grep -E ' [A-Za-z] ' | " +
      "grep -v ' clamor_'");
}

TEST_F(PackagedLibrary, IsFoundByCMakeAsAnArchive_NoAsan) {
  const std::string source = prefix_ + "/static_client";
  fs::create_directories(source);
  std::ofstream(source + "/CMakeLists.txt")
      << "cmake_minimum_required(VERSION 3.25)\nproject(client C)\nfind_package(clamor REQUIRED)\n"
      << "add_executable(client " << examples() << "/play_to_wav.c)\n"
      << "target_link_libraries(client clamor::clamor_static)\n";
  run("cmake -S " + source + " -B " + source + "/build -G Ninja -DCMAKE_PREFIX_PATH=" + prefix_);
  run("cmake --build " + source + "/build");
  EXPECT_THAT(run("objdump -p " + source + "/build/client"),
              ::testing::Not(::testing::HasSubstr("libclamor.so")));
}

// The library alone can be installed without the program and without what development needs.
TEST_F(PackagedLibrary, IsInstalledInComponents_NoAsan) {
  const fs::path build = fs::path(testing::kProgram).parent_path();
  const std::string into = prefix_ + "/component";
  run("cmake --install " + build.string() + " --component runtime --prefix " + into);
  for (const auto& entry : fs::recursive_directory_iterator(into))
    EXPECT_TRUE(entry.is_directory() || entry.path().parent_path().filename() == "libclamor0" ||
                entry.path().filename().string().starts_with("libclamor.so.") ||
                entry.path().filename().string().starts_with("libclamor_bake.so."))
        << entry.path();
  EXPECT_TRUE(fs::exists(prefix_ + "/share/man/man1/clamor-bake.1.gz"));
  EXPECT_TRUE(fs::exists(prefix_ + "/share/bash-completion/completions/clamor"));
}

// The whole interface begins with clamor_, and what is in the library besides cannot clash with an
// application's own symbols.
TEST_F(PackagedLibrary, ShowsNothingButItsInterface_NoAsan) {
  std::istringstream symbols(run("nm -D --defined-only " + libraries() + "/libclamor.so"));
  std::string address, kind, name;
  int count = 0;
  while (symbols >> address >> kind >> name) {
    EXPECT_TRUE(name.starts_with("clamor_")) << name;
    ++count;
  }
  EXPECT_GT(count, 15);
}

// Packaging notes (tools/packaging/README.md) list the licence of each library that it links.
TEST_F(PackagedLibrary, LinksOnlyLibrariesWhoseLicencesAreListed_NoAsan) {
  std::istringstream needed(run("objdump -p " + libraries() + "/libclamor.so | grep NEEDED"));
  std::ifstream page(std::string(testing::kSourceDir) + "/tools/packaging/README.md");
  const std::string notes{std::istreambuf_iterator<char>(page), {}};
  for (std::string word, name; needed >> word >> name;) {
    const std::string stem = name.substr(0, name.find_first_of("-.0123456789"));
    EXPECT_THAT(notes, ::testing::HasSubstr("`" + stem)) << name;
  }
}

// Neither it nor what it links loads a sound device's library or one under the GPL.
TEST_F(PackagedLibrary, LoadsNoSoundDeviceAndNoGplLibrary_NoAsan) {
  const std::string loaded = run("ldd " + libraries() + "/libclamor.so");
  for (const char* library :
       {"rtaudio", "jack", "pulse", "asound", "portaudio", "openal", "fftw", "not found"})
    EXPECT_THAT(loaded, ::testing::Not(::testing::HasSubstr(library)));
}

}  // namespace
}  // namespace clamor
