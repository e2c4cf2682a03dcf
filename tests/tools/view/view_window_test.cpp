// Tests of the window, on a display in memory: a script plays the mouse and the keys, pictures are
// read back, and what was recorded is compared with a render.
#include <array>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <regex>
#include <set>
#include <sstream>

#include <gmock/gmock.h>

#include "formats/audio/audio_file.h"
#include "formats/level/sidecar.h"
#include "tests/box_level.h"
#include "tests/door_level.h"
#include "tests/shell.h"
#include "tests/tools/run_clamor.h"

namespace clamor::testing {
namespace {

using ::testing::HasSubstr;

struct Picture {
  int width = 0, height = 0;
  std::string bytes;

  std::array<int, 3> at(int x, int y) const {
    const std::size_t first = 3 * (static_cast<std::size_t>(y) * static_cast<std::size_t>(width) +
                                   static_cast<std::size_t>(x));
    std::array<int, 3> colour{};
    for (std::size_t c = 0; c < 3; ++c) colour[c] = static_cast<unsigned char>(bytes[first + c]);
    return colour;
  }
};

Picture read_picture(const std::string& path) {
  std::istringstream file(read(path));
  Picture picture;
  std::string kind;
  int most = 0;
  file >> kind >> picture.width >> picture.height >> most;
  file.get();
  picture.bytes.assign(std::istreambuf_iterator<char>(file), {});
  EXPECT_EQ(picture.bytes.size(), 3u * static_cast<std::size_t>(picture.width * picture.height));
  return picture;
}

// What the window leaves for the level between its panels.
struct View {
  int left = 0, top = 46, right = 1024 - 348, bottom = 700 - 164;
};

class ViewWindow : public ::testing::Test {
 protected:
  void SetUp() override {
    if (clamor({"view", "missing.glb"}).err.find("without the window") != std::string::npos)
      GTEST_SKIP() << "built without GLFW, OpenGL and Dear ImGui";
    if (!testing::has("xvfb-run")) GTEST_SKIP() << "xvfb is missing";
    level_ = box_level(folder_);
    folder_.write("box.acoustics.json", R"({"materials": {"*": "brick"}, "emitters": [
      {"name": "hiss", "signal": "noise", "at": [2, 1.5, 1.5], "facing": [0, 0, 1],
       "directivity": 2}]})");
  }

  // Runs the window and returns what it printed.
  std::string run(const std::string& file, const std::string& options, const std::string& script,
                  const std::string& before = "") {
    folder_.write("script.txt", "size 1024 700\nwait sound\n" + script + "quit\n");
    const std::string out = folder_ / "out.txt";
    const std::string command = before + "xvfb-run -a -s '-screen 0 1280x1024x24' " +
                                std::string(kProgram) + " view " + file +
                                " --device none --voices 100 --script " + (folder_ / "script.txt") +
                                " " + options + " > " + out + " 2>&1";
    EXPECT_EQ(std::system(command.c_str()), 0) << read(out);
    return read(out);
  }

  const Folder folder_;
  std::string level_;
};

// Wall and outline are told apart by colour: walls are grey or tinted, the outline is pure amber.
bool is_amber(const std::array<int, 3>& colour) {
  return colour[0] > 225 && colour[1] > 110 && colour[1] < 190 && colour[2] < 90;
}

TEST_F(ViewWindow, ShowsTheLevelAndOutlinesTheSurfaceThatIsClicked_NoAsan) {
  const std::string before = folder_ / "before.ppm", after = folder_ / "after.ppm";
  run(level_, "--photons 500 --sources 500 --listener 2,1.5,4.5",
      "screenshot " + before + "\nmove 100 300\nclick\nwait frames 3\nscreenshot " + after + "\n");
  const Picture plain = read_picture(before), outlined = read_picture(after);
  ASSERT_EQ(plain.width, 1024);
  ASSERT_EQ(plain.height, 700);
  const View view;
  std::set<std::array<int, 3>> shades;
  int dark = 0, amber_before = 0, amber_after = 0;
  for (int y = view.top; y < view.bottom - 50; ++y)
    for (int x = view.left; x < view.right; ++x) {
      shades.insert(plain.at(x, y));
      dark += plain.at(x, y)[0] < 40 ? 1 : 0;
      amber_before += is_amber(plain.at(x, y)) ? 1 : 0;
      amber_after += is_amber(outlined.at(x, y)) ? 1 : 0;
    }
  const int all = (view.bottom - 50 - view.top) * (view.right - view.left);
  EXPECT_LT(dark, all / 20) << "the listener stands in a closed room: walls everywhere";
  EXPECT_GT(shades.size(), 20u) << "walls differ by their light";
  // The edges of the far wall and those that lead to it: at least its circumference, 2 px wide.
  EXPECT_GT(amber_after - amber_before, 1500);
}

TEST_F(ViewWindow, SavesAnEditAndBakesWhatClamorBakeBakes_NoAsan) {
  const std::string ours = folder_ / "ours.clamor", theirs = folder_ / "theirs.clamor";
  const std::string settings = "--photons 2500 --sources 2000";
  const std::string said =
      run(level_, settings + " --listener 2,1.5,4.5 -o " + ours,
          "move world 2 1.5 1.5\nclick\nwait frames 3\nmove \"Turn round\"\nclick\n"
          "wait quick\nprint edit\nkey Ctrl+S\nwait frames 5\nwait final\n");
  EXPECT_THAT(said, HasSubstr("edit to sound"));
  EXPECT_THAT(said, ::testing::Not(HasSubstr("edit to sound 0.00")));
  const auto sidecar =
      parse_sidecar(read(folder_ / "box.acoustics.json"), MaterialPresets::built_in());
  ASSERT_TRUE(sidecar.ok());
  ASSERT_EQ(sidecar->emitters.size(), 1u);
  EXPECT_LT(length(sidecar->emitters[0].facing - Vec3(0, 0, -1)), 1e-9);
  ASSERT_EQ(
      clamor({"bake", level_, "-o", theirs, "--quiet", "--photons", "2500", "--sources", "2000"})
          .code,
      0);
  EXPECT_FALSE(read(ours).empty());
  EXPECT_TRUE(read(ours) == read(theirs));
  for (const std::string& name : folder_.names())
    EXPECT_EQ(name.find(".unsaved"), std::string::npos) << name;
}

// A box whose far wall is missing: black, where it is not marked.
TEST_F(ViewWindow, ShowsTheHoleThatInspectNamesAndAddsTheSoundThatIsDropped_NoAsan) {
  Mesh mesh = box({4, 3, 5});
  mesh.triangles.resize(10);  // no wall z = 5
  level_of(folder_, mesh);
  std::filesystem::copy_file(std::string(kSourceDir) + "/assets/levels/sounds/violin.flac",
                             folder_ / "violin.flac");
  const std::string bake = folder_ / "box.clamor", marked = folder_ / "marked.ppm";
  ASSERT_EQ(
      clamor({"bake", level_, "-o", bake, "--quiet", "--photons", "500", "--sources", "500"}).code,
      0);
  std::smatch command;
  const std::string said = clamor({"inspect", bake}).out;
  ASSERT_TRUE(std::regex_search(said, command, std::regex("clamor view .* (--at [-0-9.,]+)")))
      << said;
  // After a click in a panel, Tab still switches between the bakes, each time.
  const std::string printed =
      run(bake, command.str(1) + " --compare " + bake,
          "wait frames 1\nscreenshot " + marked + "\nmove \"Listen\"\nclick\nwait frames 1\n" +
              "key Tab\nwait frames 1\nkey Tab\nwait frames 1\nprint edit\n" +
              "key Tab\nwait frames 1\nprint edit\nmove \"Findings\"\nclick\nwait frames 1\n" +
              "move \"Opening 1\"\nclick\nwait frames 1\n" + "drop " + (folder_ / "violin.flac") +
              "\nwait frames 1\nkey Ctrl+S\nwait frames 1\n");
  EXPECT_LT(printed.find("playing A"), printed.find("playing B")) << printed;
  EXPECT_THAT(printed, HasSubstr("playing B"));
  const Picture picture = read_picture(marked);
  const View view;
  int red = 0, dark = 0;
  for (int y = -30; y < 30; ++y)
    for (int x = -30; x < 30; ++x) {
      const auto colour =
          picture.at((view.left + view.right) / 2 + x, (view.top + view.bottom) / 2 + y);
      red += colour[0] > 180 && colour[1] < 130 && colour[2] < 130 ? 1 : 0;
      dark += colour[0] < 40 ? 1 : 0;
    }
  EXPECT_GT(red, 150) << "a ring in the middle of the picture";
  EXPECT_GT(dark, 1500) << "round the opening";
  const auto sidecar =
      parse_sidecar(read(folder_ / "box.acoustics.json"), MaterialPresets::built_in());
  ASSERT_TRUE(sidecar.ok());
  ASSERT_EQ(sidecar->emitters.size(), 2u);
  EXPECT_EQ(sidecar->emitters[1].signal, "violin.flac");
}

// Level and bake are replaced once the window shows them, by those of a longer box.
TEST_F(ViewWindow, FollowsABakeThatIsMadeAgain_NoAsan) {
  const std::string bake = folder_ / "box.clamor", next = folder_ / "next.clamor",
                    before = folder_ / "before.ppm", after = folder_ / "after.ppm";
  const auto make = [&](const std::string& output) {
    ASSERT_EQ(clamor({"bake", level_, "-o", output, "--quiet", "--photons", "500", "--sources",
                      "500", "--no-journal"})
                  .code,
              0);
  };
  make(bake);
  level_of(folder_, box({4, 3, 9}));
  make(next);
  std::filesystem::rename(folder_ / "box.gltf", folder_ / "next.gltf");
  std::filesystem::rename(folder_ / "box.bin", folder_ / "next.bin");
  box_level(folder_);
  const std::string replace = "(cd " + folder_.path() +
                              "; for i in $(seq 1000); do [ -s before.ppm ] && break; sleep 0.02; "
                              "done; mv next.bin box.bin; mv next.gltf box.gltf; "
                              "mv next.clamor box.clamor) & ";
  run(bake, "--listener 2,1.5,1.5,180",
      "screenshot " + before + "\nwait rebaked\nscreenshot " + after + "\n", replace);
  const Picture near = read_picture(before), far = read_picture(after);
  const View view;
  std::size_t changed = 0;
  for (int y = view.top; y < view.bottom - 50; ++y)
    for (int x = view.left; x < view.right; ++x) changed += near.at(x, y) != far.at(x, y) ? 1 : 0;
  EXPECT_GT(changed, 50'000u) << "the far wall has moved";
}

double level_db(const std::string& path) {
  const auto sound = read_channels(path, 2);
  EXPECT_TRUE(sound.ok());
  if (!sound.ok()) return 0;
  double power = 0;
  std::size_t count = 0;
  for (const auto& channel : sound->channels)
    for (std::size_t i = 9600; i < channel.size(); ++i, ++count)
      power += static_cast<double>(channel[i]) * static_cast<double>(channel[i]);
  return 10 * std::log10(power / static_cast<double>(count));
}

TEST_F(ViewWindow, IsHeardLikeARender_NoAsan) {
  const std::string bake = folder_ / "box.clamor", heard = folder_ / "heard.wav",
                    rendered = folder_ / "rendered.wav";
  // Fewer sources than are mixed even on the busiest machine (MixerLoadControl::kMinVoices).
  ASSERT_EQ(clamor({"bake", level_, "-o", bake, "--quiet", "--photons", "100", "--sources", "25",
                    "--early-order", "0"})
                .code,
            0);
  run(bake, "--listener 2,1.5,4 --record " + heard, "wait seconds 1.2\n");
  ASSERT_EQ(clamor({"render", bake, "-o", rendered, "--listener", "2,1.5,4", "--seconds", "1.2",
                    "--voices", "100"})
                .code,
            0);
  // The noise is random, so 1 s of it is known to about 0.2 dB.
  EXPECT_NEAR(level_db(heard), level_db(rendered), 1.0);
}

// One click in the list opens the door; it is drawn and, by the portal that is put into its doorway
// and saved, it is one with the next bake.
TEST_F(ViewWindow, OpensADoorWithTheMouseAndSavesThePortalInItsDoorway_NoAsan) {
  const std::string rooms = door_level(folder_), before = folder_ / "before.ppm",
                    after = folder_ / "after.ppm";
  folder_.write("rooms.acoustics.json", R"({"movable": ["Door"], "emitters": [
    {"name": "hiss", "signal": "noise", "at": [2, 1.5, 1.2]}]})");
  const std::string said =
      run(rooms, "--photons 500 --sources 500 --listener 3,1.6,2.5,-90",
          "print doors\nscreenshot " + before + "\nmove \"Open Door\"\nclick\nwait seconds 1\n" +
              "print doors\nscreenshot " + after + "\nmove \"door Door\"\nclick\nwait frames 2\n" +
              "move \"Add portal in its doorway\"\nclick\nwait frames 2\nkey Ctrl+S\n" +
              "wait frames 2\nprint doors\n" +
              "move \"opened by Door\"\nclick\nwait frames 2\nprint doors\nkey Ctrl+S\n" +
              "wait frames 2\n");
  EXPECT_THAT(said, HasSubstr("part 'Door' moved 0 %"));
  EXPECT_THAT(said, HasSubstr("part 'Door' moved 100 %"));
  EXPECT_THAT(said, HasSubstr("portal 'Door' opened by 'Door'"));
  EXPECT_THAT(said, HasSubstr("portal 'Door' open 100 %")) << "after it was uncoupled";
  const Picture closed = read_picture(before), open = read_picture(after);
  std::size_t changed = 0;
  const View view;
  for (int y = view.top; y < view.bottom - 50; ++y)
    for (int x = view.left; x < view.right; ++x)
      changed += closed.at(x, y) != open.at(x, y) ? 1 : 0;
  EXPECT_GT(changed, 5'000u) << "the leaf has left the doorway";
  const auto sidecar =
      parse_sidecar(read(folder_ / "rooms.acoustics.json"), MaterialPresets::built_in());
  ASSERT_TRUE(sidecar.ok()) << sidecar.error().message;
  ASSERT_EQ(sidecar->portals.size(), 1u);
  EXPECT_EQ(sidecar->portals[0].portal.name, "Door");
  EXPECT_EQ(sidecar->portals[0].parts, PartPatterns(std::in_place));
  EXPECT_LT(length(sidecar->portals[0].portal.centre_m - Vec3(6, 1, 2.5)), 0.01);
}

TEST_F(ViewWindow, SaysThatAScriptWaitsForWhatCannotCome_NoAsan) {
  const std::string bake = folder_ / "box.clamor";
  ASSERT_EQ(
      clamor({"bake", level_, "-o", bake, "--quiet", "--photons", "100", "--sources", "100"}).code,
      0);
  const auto said = [&](const std::string& wait) {
    folder_.write("script.txt", "wait sound\n" + wait + "\nquit\n");
    const std::string out = folder_ / "out.txt";
    const std::string command = "xvfb-run -a -s '-screen 0 1280x1024x24' " + std::string(kProgram) +
                                " view " + bake + " --device none --script " +
                                (folder_ / "script.txt") + " > " + out + " 2>&1";
    EXPECT_NE(std::system(command.c_str()), 0);
    return read(out);
  };
  EXPECT_THAT(said("wait final"), HasSubstr("script, line 2: no bake comes"));
  EXPECT_THAT(said("wait rebaked 0.1"), HasSubstr("script, line 2: it waited for 0.1 s in vain"));
}

TEST(ViewCommand, SaysHowToGetTheWindowOrWhatIsWrong) {
  const Outcome missing = clamor({"view", "missing.glb"});
  EXPECT_EQ(missing.code, 1);
  EXPECT_TRUE(missing.err.find("libimgui-dev") != std::string::npos ||
              missing.err.find("missing.glb") != std::string::npos)
      << missing.err;
}

}  // namespace
}  // namespace clamor::testing
