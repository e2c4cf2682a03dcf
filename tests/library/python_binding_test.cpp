// python_binding_test.cpp: the Python package against the header, and against the program.
#include <filesystem>
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
using testing::TemporaryFile;

class PythonBinding : public ::testing::Test {
 protected:
  // The interpreter that has numpy; a system may have several.
  static std::string python() {
    for (const std::string name : {"python3", "/usr/bin/python3"})
      if (std::system((name + " -c 'import numpy' >/dev/null 2>&1").c_str()) == 0) return name;
    return "";
  }

  void SetUp() override {
    if (python_.empty()) GTEST_SKIP() << "not on this machine: Python 3 with numpy";
  }

  static void check(const std::string& arguments, const std::string& script = "python_binding.py") {
    run_with_libraries(python_ + " " + testing::kSourceDir + "/tests/library/" + script + " " +
                       arguments);
  }

  static inline const std::string python_ = python();
};

TEST_F(PythonBinding, DeclaresAllOfTheHeaderAsTheCompilerSeesIt_NoAsan) {
  const TemporaryFile table(
      ".txt",
      testing::header_table(std::string(testing::kSourceDir) + "/runtime/clamor.h", "CLAMOR_API"));
  check("interface runtime " + table.path());
}

TEST_F(PythonBinding, RendersTheSamplesOfTheProgram_NoAsan) {
  const TemporaryFile walk(
      ".json", R"({"points":[{"time_s":0,"position_m":[0,1.7,3],"yaw_deg":0},)"
               R"({"time_s":0.08,"position_m":[1,1.7,2],"yaw_deg":170,"pitch_deg":20},)"
               R"({"time_s":0.08,"position_m":[1,1.7,1],"yaw_deg":170},)"  // a jump
               R"({"time_s":0.15,"position_m":[2,1.5,1],"yaw_deg":-90,"roll_deg":10}]})");
  const auto compare = [&](const std::string& flags, const std::string& options) {
    const TemporaryFile wav(".wav");
    run_with_libraries("clamor render " + testing::violin_room() + " -o " + wav.path() +
                       " --walk " + walk.path() + " --voices 200 " + flags);
    check("render " + testing::violin_room() + " " + walk.path() + " " + wav.path() +
          " '{\"voices\": 200, " + options + "}'");
  };
  compare("--headphones", R"("output": "binaural")");
  compare(
      "--layout 5.1 --seconds 0.2 --gain -6dB",
      R"("output": "loudspeakers", "layout": "5.1", "seconds": 0.2, "gain": 0.5011872336272722)");
  compare("--receivers omni", R"("output": "receivers")");
}

TEST_F(PythonBinding, PlaysSoundsStreamsAndSourcesOfTheApplication_NoAsan) {
  check("sources " + testing::violin_room());
}

TEST_F(PythonBinding, OpensDoorsAndPortalsAndChangesReverberation_NoAsan) {
  check("doors " + testing::rooms_with_door());
}

using PythonBakeBinding = PythonBinding;

TEST_F(PythonBakeBinding, DeclaresAllOfTheHeaderAsTheCompilerSeesIt_NoAsan) {
  const TemporaryFile table(
      ".txt", testing::header_table(std::string(testing::kSourceDir) + "/bake/clamor_bake.h",
                                    "CLAMOR_BAKE_API"));
  check("interface bake " + table.path());
}

TEST_F(PythonBakeBinding, BakesTheBytesOfTheProgramAndTheTrianglesOfArrays_NoAsan) {
  const testing::EmptyFolder folder;
  check("bake " + std::string(testing::kSourceDir) + "/assets/levels/violin_room.glb " +
        testing::violin_room() + " " + folder.path());
}

TEST_F(PythonBakeBinding, GivesImpulseResponsesWithDirectSoundOfTheRightDelayAndAmplitude_NoAsan) {
  const testing::EmptyFolder folder;
  check("respond " + folder.path());
}

TEST_F(PythonBakeBinding, WritesIntoTheCallersArraysWithoutCopies_NoAsan) {
  const testing::EmptyFolder folder;
  check("arrays " + folder.path());
}

TEST_F(PythonBinding, WarnsOfPlacesOutsideTheLevel_NoAsan) {
  check("outside " + testing::violin_room());
}

TEST_F(PythonBakeBinding, NamesTheArgumentThatIsWrongInEveryPublicCall_NoAsan) {
  check(testing::rooms_with_door(), "python_arguments.py");
}

TEST_F(PythonBinding, OpensBytesRendersInRealTimeAndRaisesErrors_NoAsan) {
  check("use " + testing::violin_room());
}

}  // namespace
}  // namespace clamor
