// Tests clamor report as its user runs it.
#include <filesystem>
#include <regex>
#include <span>

#include <gmock/gmock.h>
#include <nlohmann/json.hpp>

#include "tests/box_level.h"
#include "tests/tools/drawn_page.h"
#include "tests/tools/report/reported_room.h"
#include "tools/analysis/json_values.h"

namespace clamor::testing {
namespace {

using ::testing::HasSubstr;

class ReportCommand : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    Level level = shoebox({6, 3, 4}, uniform_material(0.2f), {2, 1, 1});
    level.materials[0].name = "</script><b>";
    reported_ = std::make_unique<ReportedRoom>(level, 300, 5000);
  }
  static void TearDownTestSuite() { reported_.reset(); }

  // The path of a page.
  static std::string page(std::vector<std::string> more = {}) {
    const std::string path = reported_->folder() / "page.html";
    more.insert(more.begin(), {"report", reported_->path(), "-o", path});
    const Outcome outcome = clamor(more);
    EXPECT_EQ(outcome.code, 0) << outcome.err;
    EXPECT_THAT(outcome.err, HasSubstr("page.html"));
    return path;
  }

  static std::unique_ptr<ReportedRoom> reported_;
};
std::unique_ptr<ReportedRoom> ReportCommand::reported_;

TEST_F(ReportCommand, WritesOneFileThatAsksTheNetworkForNothing) {
  const std::string path = page(), html = read(path);
  // Only names of XML namespaces are addresses.
  std::string rest = std::regex_replace(html, std::regex("http://www.w3.org/2000/svg"), "");
  EXPECT_EQ(rest.find("http"), std::string::npos);
  EXPECT_EQ(rest.find("@import"), std::string::npos);
  // A name cannot end the script that holds the data.
  EXPECT_EQ(html.find("</script><b>"), std::string::npos);
  EXPECT_LT(html.size(), 2'000'000u);
  if (!has_node()) GTEST_SKIP() << "not on this machine: node";
  const std::string shown = drawn(path);
  EXPECT_THAT(shown, HasSubstr("It reverberates for"));
  EXPECT_THAT(shown, HasSubstr("The bake found nothing wrong with the level."));
  for (const std::string heading : {"The level", "What it sounds like", "At the listeners",
                                    "Over the floor", "What absorbs the sound", "The file"})
    EXPECT_THAT(shown, HasSubstr(heading + "</h2>"));
  EXPECT_EQ(shown.find("</script><b>"), std::string::npos);
  EXPECT_THAT(shown, HasSubstr("&lt;/script&gt;&lt;b&gt;</th>"));
  for (const char* const no_figure : {"undefined", "NaN", "Infinity", "null"})
    EXPECT_EQ(shown.find(no_figure), std::string::npos) << no_figure;
}

// A stand-in for the package of tools/bundle --wasm, whose parts can be told apart in the page.
TEST_F(ReportCommand, ListenEmbedsThePlayerAndTheBakes) {
  const Folder player;
  for (const char* const name : {"clamor.mjs", "declarations.js", "native.js", "remote_bake.js",
                                 "worker.js", "worklet.js", "player.js"})
    player.write(name, std::string("import {x} from \"./other.js\";\nexport const of = \"") + name +
                           "\" + import.meta.url;\nexport default x;\n");
  player.write("clamor.wasm", std::string(30'000, 'w'));
  const auto silent_bytes = read(page()).size();
  const ReportedRoom other(shoebox({5, 3, 4}, uniform_material(0.4f), {2, 1, 1}), 300, 2000);
  const std::string html = read(page({"--listen", player.path(), "--compare", other.path()}));
  for (const char* const id : {"worker", "worklet", "wasm", "bake", "other"})
    EXPECT_NE(html.find(std::string("id=\"listen-") + id + "\">"), std::string::npos);
  for (const char* const name : {"clamor.mjs", "remote_bake.js", "worklet.js", "player.js"})
    EXPECT_NE(html.find(std::string("const of = \"") + name + "\" + location.href;"),
              std::string::npos);
  for (const char* const of_modules : {"import {", "export const", "export default", "import.meta"})
    EXPECT_EQ(html.find(of_modules), std::string::npos) << of_modules;
  const std::string bake = read(reported_->path());
  const auto bytes = std::as_bytes(std::span(bake));
  EXPECT_NE(html.find(column(std::vector(bytes.begin(), bytes.end()))), std::string::npos);
  EXPECT_LT(read(page({"--listen", player.path()})).size(),
            silent_bytes + (bake.size() + 30'000) * 4 / 3 + 100'000);

  std::filesystem::remove(player / "clamor.wasm");
  const Outcome without =
      clamor({"report", reported_->path(), "-o", player / "page.html", "--listen", player.path()});
  EXPECT_NE(without.code, 0);
  EXPECT_THAT(without.err, HasSubstr("clamor.wasm"));
  EXPECT_THAT(without.err, HasSubstr("tools/bundle --wasm"));
  EXPECT_FALSE(std::filesystem::exists(player / "page.html"));
}

TEST_F(ReportCommand, WarnsOfListenersOutsideEitherLevel) {
  const ReportedRoom other(shoebox({3, 3, 4}, uniform_material(0.4f), {2, 1, 1}), 300, 2000);
  const Outcome outcome =
      clamor({"report", reported_->path(), "-o", reported_->folder() / "page.html", "--quiet",
              "--listener", "5.5,1,2", "--compare", other.path()});
  EXPECT_EQ(outcome.code, 0);
  EXPECT_THAT(outcome.err, HasSubstr(other.path() + ": hardly anything is heard at 5.5,1,2"));
  EXPECT_EQ(outcome.err.find(reported_->path() + ": "), std::string::npos) << outcome.err;
}

TEST_F(ReportCommand, SaysTheFiguresOfImpulse_NoAsan) {
  if (!has_node()) GTEST_SKIP() << "not on this machine: node";
  const std::string html = drawn(page({"--listener", "4,1.5,2", "--exact"}));
  const Outcome impulse = clamor({"impulse", reported_->path(), "--listener", "4,1.5,2"});
  ASSERT_EQ(impulse.code, 0);
  std::smatch row;
  ASSERT_TRUE(
      std::regex_search(impulse.out, row, std::regex(R"(T30 s +([\d.]+) +([\d.]+) +([\d.]+))")));
  EXPECT_THAT(html, HasSubstr("<th scope=\"row\">T30 (s)</th><td>" + row[1].str() + "</td><td>" +
                              row[2].str() + "</td><td>" + row[3].str() + "</td>"));
  EXPECT_THAT(html, HasSubstr("Listener 1 at 4.0, 1.5, 2.0 m"));
}

TEST_F(ReportCommand, SaysTheFiguresOfInspect_NoAsan) {
  if (!has_node()) GTEST_SKIP() << "not on this machine: node";
  const std::string html = drawn(page({"--listener", "4,1.5,2"}));
  const Outcome inspect = clamor({"inspect", reported_->path()});
  std::smatch row;
  ASSERT_TRUE(std::regex_search(inspect.out, row, std::regex(R"(power emitted, dB +([\d.]+))")));
  EXPECT_THAT(html, HasSubstr("power emitted, dB</th><td>" + row[1].str() + "</td>"));
  ASSERT_TRUE(std::regex_search(inspect.out, row, std::regex(R"(settings +(seed [^\n]*))")));
  EXPECT_THAT(html, HasSubstr(row[1].str()));
}

// A box without a floor, on which the report would map parameters, and upright boards with slits of
// 1.2 mm and 1 cm between them: the geometry in the file, in millimetres, would not show the first
// as it is.
TEST(LevelFigures, AreTheSameOfBakeInspectAndReport) {
  if (!has_node()) GTEST_SKIP() << "not on this machine: node";
  const Folder folder;
  Mesh mesh = box({6, 3, 4});
  mesh.triangles.erase(mesh.triangles.begin() + 4, mesh.triangles.begin() + 6);
  mesh.materials.resize(mesh.triangles.size());
  for (const float z : {0.5f, 1.5012f, 2.5112f})
    add_quad(mesh, {Vec3f(3, 1, z), Vec3f(3, 2, z), Vec3f(3, 2, z + 1), Vec3f(3, 1, z + 1)});
  const std::string level = level_of(folder, mesh), bake = folder / "box.clamor";
  const Outcome baked = clamor({"bake", level, "-o", bake, "--photons", "200", "--sources", "200",
                                "--no-journal", "--emitter", "name=a,signal=noise,at=2,1.5,1"});
  ASSERT_EQ(baked.code, 0) << baked.err;
  std::smatch line;
  ASSERT_TRUE(std::regex_search(
      baked.err, line,
      std::regex("level    (2 thin gaps between edges that nearly meet: (.*); (.*))\n")))
      << baked.err;
  const std::string all = line[1], widest = line[2], second = line[3];
  ASSERT_TRUE(
      std::regex_search(baked.err, line, std::regex("warning  (\\d+ % of the sound leaves.*)\n")))
      << baked.err;
  const std::string leaves = line[1];

  const Outcome inspected = clamor({"inspect", bake});
  EXPECT_THAT(inspected.out, HasSubstr("level: " + all));
  EXPECT_THAT(inspected.out, HasSubstr("warning: " + leaves));
  const auto json = nlohmann::json::parse(clamor({"inspect", bake, "--json"}).out);
  EXPECT_EQ(json["findings"]["thin_gaps"], 2);
  EXPECT_EQ(json["findings"]["closedness"], leaves);
  ASSERT_EQ(clamor({"report", bake, "-o", folder / "box.html"}).code, 0);
  const std::string html = drawn(folder / "box.html");
  for (const std::string& words : {widest, second, leaves.substr(0, leaves.find(" of the sound"))})
    EXPECT_THAT(html, HasSubstr("<span>" + words));
  EXPECT_EQ(html.find("more; "), std::string::npos) << "there are no others";
}

// Its walls let sound out, which is no reason to look for a hole.
TEST(LevelFigures, OfAClosedLevelSayThatPowerPassedItsWalls) {
  if (!has_node()) GTEST_SKIP() << "not on this machine: node";
  Level level = shoebox({6, 3, 4}, uniform_material(0.2f), {2, 1, 1});
  level.materials[0].transmission = same_in_all_bands(0.1f);
  const ReportedRoom closed(level, 300, 5000);
  const std::string page = closed.folder() / "page.html";
  ASSERT_EQ(clamor({"report", closed.path(), "-o", page, "--listener", "4,1.5,2"}).code, 0);
  const std::string html = drawn(page);
  EXPECT_THAT(html, HasSubstr("closed: none of"));
  EXPECT_THAT(html, HasSubstr("of the power left the level, through walls"));
  EXPECT_THAT(html, HasSubstr(">left through walls<"));
  const std::string tables = clamor({"inspect", closed.path()}).out;
  EXPECT_THAT(tables, HasSubstr("closed: none of"));
  EXPECT_THAT(tables, HasSubstr("% of the power, through walls"));
  const auto power =
      nlohmann::json::parse(clamor({"inspect", closed.path(), "--json"}).out)["power"];
  EXPECT_EQ(power["through_openings"], 0);
  EXPECT_NEAR(power["through_walls"].get<double>(), 0.5, 0.06);
}

TEST_F(ReportCommand, SetsAnotherBakeBesideIt) {
  if (!has_node()) GTEST_SKIP() << "not on this machine: node";
  Level dry = shoebox({6, 3, 4}, uniform_material(0.6f), {2, 1, 1});
  const ReportedRoom other(dry, 300, 5000);
  const std::string html = drawn(page({"--listener", "4,1.5,2", "--compare", other.path()}));
  EXPECT_THAT(html, HasSubstr("difference in just-noticeable differences"));
  // A room that absorbs three times as much decays more than ten noticeable steps faster.
  std::smatch row;
  ASSERT_TRUE(
      std::regex_search(html, row, std::regex(R"(T30</th><td>[^<]*</td><td>(-[\d.]+)</td>)")));
  EXPECT_LT(std::stod(row[1]), -10);
}

TEST_F(ReportCommand, RefusesWhatItCannotDo) {
  const auto fails = [&](std::vector<std::string> words, int code, const std::string& message) {
    words.insert(words.begin(), "report");
    const Outcome outcome = clamor(words);
    EXPECT_EQ(outcome.code, code) << outcome.err;
    EXPECT_THAT(outcome.err, HasSubstr(message));
  };
  const std::string file = reported_->path(), page = reported_->folder() / "no.html";
  fails({file}, 2, "-o");
  fails({file, "-o", file}, 1, "room.clamor");
  fails({file, "-o", page, "--listener", "here"}, 2, "here");
  fails({file, "-o", page, "--from", "sourse"}, 1, "the nearest of 1 names is 'source'");
  fails({page, "-o", page}, 1, "no.html");
  fails({file, "-o", page, "--compare", page}, 1, "no.html");
  EXPECT_FALSE(std::filesystem::exists(page));
}

}  // namespace
}  // namespace clamor::testing
