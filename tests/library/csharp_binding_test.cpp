// csharp_binding_test.cpp: Clamor.cs against the header, and against the program, on Mono.
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/build_paths.h"
#include "tests/library/binding_run.h"
#include "tests/library/header_table.h"
#include "tests/library/library_room.h"
#include "tests/temporary_file.h"

namespace clamor {
namespace {

using testing::run_with_libraries;

const std::string kFolder = "/runtime/bindings/csharp/";
const std::string kSources = std::string(testing::kSourceDir) + kFolder + "*.cs " +
                             testing::build_folder() + kFolder + "ClamorNative.cs ";

class CSharpBinding : public ::testing::Test {
 protected:
  static bool has_mono() {
    return std::system("mcs --version >/dev/null 2>&1 && mono --version >/dev/null 2>&1") == 0;
  }

  // Compiled once, when the first test needs it.
  static const std::string& program() {
    static const testing::TemporaryFile file(".exe");
    static const std::string output =
        run_with_libraries("mcs -warnaserror+ -out:" + file.path() + " " + kSources +
                           testing::kSourceDir + "/tests/library/csharp_binding*.cs");
    return file.path();
  }

  void SetUp() override {
    static const bool has = has_mono();
    if (!has) GTEST_SKIP() << "not on this machine: mcs and mono (mono-mcs, mono-runtime)";
  }
};

TEST_F(CSharpBinding, DeclaresAllOfTheHeaderAsTheCompilerSeesIt_NoAsan) {
  const testing::TemporaryFile table(
      ".txt",
      testing::header_table(std::string(testing::kSourceDir) + "/runtime/clamor.h", "CLAMOR_API"));
  run_with_libraries("mono " + program() + " interface clamor " + table.path());
}

TEST_F(CSharpBinding, DeclaresAllOfTheHeaderOfBakesAsTheCompilerSeesIt_NoAsan) {
  const testing::TemporaryFile table(
      ".txt", testing::header_table(std::string(testing::kSourceDir) + "/bake/clamor_bake.h",
                                    "CLAMOR_BAKE_API"));
  run_with_libraries("mono " + program() + " interface clamor_bake " + table.path());
}

TEST_F(CSharpBinding, AllocatesNoManagedMemoryToRender_NoAsan) {
  run_with_libraries("mono " + program() + " allocations " + testing::violin_room());
}

TEST_F(CSharpBinding, PlaysSoundsStreamsAndSourcesOfTheApplication_NoAsan) {
  run_with_libraries("mono " + program() + " sources " + testing::violin_room());
}

TEST_F(CSharpBinding, OpensDoorsAndPortalsAndChangesReverberation_NoAsan) {
  run_with_libraries("mono " + program() + " doors " + testing::rooms_with_door());
}

TEST_F(CSharpBinding, PullsStreamsThatSoundLikeTheSameSamplesInMemory_NoAsan) {
  run_with_libraries("mono " + program() + " pull " + testing::silent_field());
}

TEST_F(CSharpBinding, BakesTheBytesOfTheProgramAndTheTrianglesOfArrays_NoAsan) {
  const testing::EmptyFolder folder;
  run_with_libraries("mono " + program() + " bake " + testing::kSourceDir +
                     "/assets/levels/violin_room.glb " + testing::violin_room() + " " +
                     folder.path());
}

TEST_F(CSharpBinding, OpensMemoryAndArchivesAndTurnsErrorsIntoExceptions_NoAsan) {
  run_with_libraries("mono " + program() + " use " + testing::violin_room());
}

// The example of the page is at most 30 lines with the commands, from an empty folder to sound.
TEST_F(CSharpBinding, TakesThirtyLinesToPlayTheSamplesOfTheProgram_NoAsan) {
  const std::string page = "runtime/bindings/csharp/README.md";
  const std::string code = testing::example_of(page, "csharp");
  const std::string commands = testing::example_of(page, "sh", "Mono (Debian");
  EXPECT_LE(testing::line_count(code) + testing::line_count(commands), 30u);
  const testing::EmptyFolder folder;
  std::ofstream(folder / "Play.cs") << code;
  run_with_libraries(
      "cd " + folder.path() + "\nexport HOME=$PWD\nmkdir clamor\nln -s " + testing::build_folder() +
      " clamor/lib\ncp " + kSources + ".\ncp " + testing::violin_room() + " room.clamor\n" +
      commands + "\n" +
      "clamor render room.clamor -o theirs.wav --receivers omni --listener 0,1.7,3 --seconds 0.5");
  constexpr std::size_t kBytes = 24'000 * 2 * sizeof(float);
  const std::string ours = testing::contents_of(folder / "room.wav");
  const std::string theirs = testing::contents_of(folder / "theirs.wav");
  ASSERT_GT(std::min(ours.size(), theirs.size()), kBytes);
  EXPECT_EQ(ours.substr(ours.size() - kBytes), theirs.substr(theirs.size() - kBytes));
}

}  // namespace
}  // namespace clamor
