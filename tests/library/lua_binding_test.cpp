// lua_binding_test.cpp: the binding for LuaJIT as it is installed, and the game in LÖVE that uses
// it.
#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include "formats/audio/audio_file.h"
#include "tests/build_paths.h"
#include "tests/shell.h"
#include "tests/temporary_file.h"

namespace clamor {
namespace {

namespace fs = std::filesystem;

// The installed tree, a small bake of the violin room and what is heard on a walk through it.
class LuaBinding : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    const fs::path build = fs::path(testing::kProgram).parent_path();
    folder_ = (fs::temp_directory_path() / ("clamor_lua_" + std::to_string(::getpid()))).string();
    succeeds("cmake --install " + build.string() + " --prefix " + folder_);
    succeeds(std::string(testing::kProgram) + " bake " + testing::kSourceDir +
             "/assets/levels/violin_room.glb -o " + room() + " --photons 300 --sources 2000");
    std::ofstream(walk()) << R"({"points":[
      {"time_s":0,"position_m":[0,1.7,3],"yaw_deg":170,"pitch_deg":-5,"roll_deg":10},
      {"time_s":0.3,"position_m":[0.3,1.7,2.6],"yaw_deg":-170.3},
      {"time_s":0.4001,"position_m":[0.3,1.65,2.6],"yaw_deg":-150}]})";
    succeeds(std::string(testing::kProgram) + " render " + room() + " --walk " + walk() + " -o " +
             theirs() + " --limiter on");
  }
  static void TearDownTestSuite() { fs::remove_all(folder_); }

  static std::string room() { return folder_ + "/violin_room.clamor"; }
  static std::string theirs() { return folder_ + "/theirs.wav"; }
  static std::string walk() { return folder_ + "/walk.json"; }
  static std::string examples() { return std::string(testing::kSourceDir) + "/runtime/examples"; }

  // Runs a command that finds the installed binding and returns what it printed.
  static std::string succeeds(const std::string& command) {
    const testing::TemporaryFile output(".txt");
    const int result =
        std::system(("export HOME=" + folder_ + " LUA_PATH='" + folder_ +
                     "/share/lua/5.1/?.lua;;'; " + command + " >" + output.path() + " 2>&1")
                        .c_str());
    EXPECT_EQ(result, 0) << command << "\n" << output.bytes();
    return output.bytes();
  }

  // Compares a recording of the walk with the program's.
  static void expect_the_programs_samples(const std::string& recording) {
    const auto heard = read_channels(recording, 2), rendered = read_channels(theirs(), 2);
    ASSERT_TRUE(heard.ok() && rendered.ok());
    const std::vector<float>& left = rendered->channels.at(0);
    EXPECT_EQ(left.size(), 19'205u);
    EXPECT_GT(*std::max_element(left.begin(), left.end()), 0.001f);
    EXPECT_EQ(heard->channels, rendered->channels);
  }

  static inline std::string folder_;
};

TEST_F(LuaBinding, RendersTheSamplesOfTheProgram_NoAsan) {
  if (!testing::has("luajit")) GTEST_SKIP() << "not on this machine: luajit";
  const std::string ours = folder_ + "/ours.wav";
  succeeds("luajit " + examples() + "/render_walk.lua " + room() + " " + walk() + " " + ours);
  expect_the_programs_samples(ours);
}

TEST_F(LuaBinding, ReturnsSentencesAndReleasesWhatIsCollected_NoAsan) {
  if (!testing::has("luajit")) GTEST_SKIP() << "not on this machine: luajit";
  const std::string script = folder_ + "/misuse.lua";
  std::ofstream(script) << R"(
    local clamor = require "clamor"
    local options = {output = "receivers", offline = true, voices = 10}
    local world = assert(clamor.new {caller_updates = true})
    print(world:open("/no/such/level.clamor"))
    print(world:open_bytes("no bake", "a level in the archive"))
    print(pcall(clamor.new, {no_such_option = 1}))
    local file = io.open(arg[1], "rb")
    local level = assert(world:open_bytes(file:read("*a")))
    print(level:info().emitters .. " emitter")
    local ears = assert(world:listen(level, options))
    level:close()
    print(pcall(level.info, level))
    local same_world, same_ears = clamor.borrow(ears:lend())
    assert(same_ears:enter(same_world:open(arg[1])))
    assert(ears:next_keyframe_s() == 0 and world:update() == 1)
    -- There is room for 64 listeners only, and for 256 levels.
    for _ = 1, 300 do
      local opened = assert(world:open(arg[1]))
      collectgarbage()
    end
    local last = assert(world:open(arg[1]))
    for _ = 1, 70 do
      local heard = assert(world:listen(last, options))
      collectgarbage()
    end
    -- Worlds are collected, and listeners keep theirs.
    local kept = clamor.new {caller_updates = true}
    kept = assert(kept:listen(kept:open(arg[1]), options))
    collectgarbage()
    collectgarbage()
    print(kept:channels() .. " channels")
    world:close()
    print(pcall(ears.channels, ears)))";
  const std::string printed = succeeds("luajit " + script + " " + room());
  for (const char* const line :
       {"nil\t/no/such/level.clamor", "nil\ta level in the archive: is not a Clamor bake",
        "no member named 'no_such_option'", "1 emitter\n",
        "false\tthe handle names no object of this context", "2 channels\n",
        "false\tan argument is null"})
    EXPECT_THAT(printed, ::testing::HasSubstr(line));
}

TEST_F(LuaBinding, IsHeardInALoveGameLikeTheProgram_NoAsan) {
  for (const char* const program : {"love", "xvfb-run"})
    if (!testing::has(program)) GTEST_SKIP() << "not on this machine: " << program;
  const std::string ours = folder_ + "/game.wav", picture = folder_ + "/game.png";
  // LÖVE shows an error until a key is pressed.
  succeeds("SDL_AUDIODRIVER=dummy ALSOFT_DRIVERS=null timeout 300 xvfb-run -a love " + examples() +
           "/love " + room() + " --walk " + walk() + " --record " + ours + " --screenshot " +
           picture);
  expect_the_programs_samples(ours);
  EXPECT_GT(fs::file_size(picture), 10'000u) << "the map is not drawn";
}

}  // namespace
}  // namespace clamor
