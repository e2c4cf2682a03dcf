// Tests that names with control sequences reach no output of any command.
#include "tools/program/terminal_output.h"

#include <sstream>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "common/counted_texts.h"
#include "common/printable.h"
#include "formats/audio/wav_writer.h"
#include "tests/tools/run_clamor.h"
#include "tools/analysis/report_page.h"

namespace clamor::testing {
namespace {

// A window title, a cleared screen by 8-bit CSI in both its forms, reversed text, a forged line.
const std::string kName =
    "a\x1b]0;x\a \xc2\x9b"
    "2J \x9b"
    "2J \xe2\x80\xae\xe2\x81\xa6 \nclamor: done";

void expect_printable(const std::string& text) {
  EXPECT_EQ(printable(text, Lines::kMany), text);
  EXPECT_EQ(text.find("\nclamor: done"), std::string::npos) << text;
}

void expect_printable(const Outcome& outcome) {
  expect_printable(outcome.out);
  expect_printable(outcome.err);
}

TEST(PrintableStream, FiltersWhatIsWrittenInAnyPieces) {
  std::ostringstream text;
  {
    const PrintableStream filter(text);
    text << "a" << '\x1b' << "[2J\xe2\x80"
         << "\xae|\xc3" << '\xbc' << "|\xc3";
  }
  EXPECT_EQ(text.str(), "a?[2J?|\xc3\xbc|?");
  text << '\x1b';  // unfiltered again
  EXPECT_EQ(text.str().back(), '\x1b');
}

TEST(PrintableStream, KeepsThatAWriteHasFailed) {
  std::ofstream full("/dev/full");
  {
    const PrintableStream filter(full);
    full << std::string(100'000, 'x') << std::flush;
    EXPECT_FALSE(full.good());
  }
  EXPECT_FALSE(full.good());
}

TEST(Names, OfABakeDoNotSteerTheTerminalThatItIsShownOn) {
  const Folder folder;
  const std::string level = folder.write("level.gltf", kEmptyLevel), file = folder / "a.clamor";
  const Outcome baked = clamor({"bake", level, "-o", file, "--photons", "10", "--emitter",
                                "name=" + kName + ",signal=noise,at=0,1,0", "--emitter",
                                "name=" + kName + "2,signal=noise,at=0,2,0"});
  ASSERT_EQ(baked.code, 0) << baked.err;
  expect_printable(baked);
  for (const std::vector<std::string>& words :
       {std::vector<std::string>{"inspect", file},
        {"inspect", file, "--json"},
        {"diff", file, file},
        {"impulse", file, "--listener", "0,1,3", "-o", folder / "ir.wav"},
        {"impulse", file, "--listener", "0,1,3", "--json", "-o", folder / "ir2.wav"},
        {"impulse", file, "--listener", "0,1,3", "--from", kName + "3", "-o", folder / "ir3.wav"},
        {"render", file, "--listener", "0,1,3", "-o", folder / "no.such.folder/x.wav"}})
    expect_printable(clamor(words));
}

TEST(Names, InJsonAreEscapedSoThatReadersGetThemBack) {
  const Folder folder;
  const std::string name = "a\xc2\x9b\xe2\x80\xae\x7f\n\x1b";
  const std::string level = folder.write("level.gltf", kEmptyLevel), file = folder / "a.clamor";
  ASSERT_EQ(clamor({"bake", level, "-o", file, "--quiet", "--photons", "10", "--emitter",
                    "name=" + name + ",signal=noise,at=0,1,0"})
                .code,
            0);
  const Outcome outcome = clamor({"inspect", file, "--json"});
  ASSERT_EQ(outcome.code, 0) << outcome.err;
  expect_printable(outcome.out);
  EXPECT_EQ(nlohmann::json::parse(outcome.out)["emitters"][0]["name"], name);
}

// A level that names things that are missing, unknown or wrong.
TEST(Names, OfALevelDoNotSteerTheTerminalByErrorsAndWarnings) {
  const Folder folder;
  const nlohmann::json good = nlohmann::json::parse(kEmptyLevel);
  std::vector<nlohmann::json> levels;
  // JSON must be valid UTF-8.
  std::string name = kName;
  name.erase(name.find("\x9b"
                       "2J \xe2"),
             1);
  levels.emplace_back(good)["extensionsRequired"] = {name};
  levels.emplace_back(good)["buffers"] = {{{"byteLength", 4}, {"uri", name}}};
  levels.emplace_back(good)["asset"]["version"] = name;
  levels.emplace_back(good)["nodes"] = {{{"name", name}, {"mesh", 7}}};
  levels.back()["scenes"][0]["nodes"] = {0};
  levels.emplace_back(good)["extensionsUsed"] = {name};
  // A wall whose material has no acoustic data.
  nlohmann::json& wall = levels.emplace_back(good);
  wall["scenes"][0]["nodes"] = {0};
  wall["nodes"] = {{{"name", name}, {"mesh", 0}}};
  wall["meshes"] = {
      {{"name", name}, {"primitives", {{{"attributes", {{"POSITION", 0}}}, {"material", 0}}}}}};
  wall["materials"] = {{{"name", name}}};
  wall["accessors"] = {
      {{"bufferView", 0}, {"componentType", 5126}, {"type", "VEC3"}, {"count", 3}}};
  wall["bufferViews"] = {{{"buffer", 0}, {"byteLength", 36}}};
  wall["buffers"] = {
      {{"byteLength", 36},
       {"uri",
        "data:application/octet-stream;base64,AAAAAAAAAAAAAAAAAACAPwAAAAAAAAAAAAAAAAAAgD8AAAAA"}}};
  const Outcome baked_wall =
      clamor({"bake", folder.write("wall.gltf", wall.dump()), "-o", folder / "wall.clamor",
              "--photons", "10", "--emitter", "name=x,signal=noise,at=0,1,1"});
  EXPECT_EQ(baked_wall.code, 0) << baked_wall.err;
  EXPECT_NE(baked_wall.err.find("a?]0;x?"), std::string::npos) << baked_wall.err;
  expect_printable(baked_wall);
  expect_printable(clamor({"inspect", folder / "wall.clamor"}));
  for (const nlohmann::json& level : levels) {
    const std::string path = folder.write("level.gltf", level.dump());
    expect_printable(clamor({"bake", path, "-o", folder / "a.clamor", "--photons", "10",
                             "--emitter", "name=x,signal=noise,at=0,1,0"}));
  }
  const std::string path = folder.write("level.gltf", kEmptyLevel);
  const nlohmann::json sidecar = {{name, 1}};
  folder.write("level.acoustics.json", sidecar.dump());
  const Outcome unknown_key = clamor({"bake", path, "-o", folder / "a.clamor"});
  EXPECT_EQ(unknown_key.code, 1);
  expect_printable(unknown_key);
  const Outcome no_signal = clamor(
      {"bake", path, "-o", folder / "a.clamor", "--emitter", "signal=" + kName + ",at=0,1,0"});
  EXPECT_NE(no_signal.code, 0);
  expect_printable(no_signal);
  expect_printable(clamor({kName}));
  expect_printable(clamor({"bake", kName, "-o", kName, "--" + kName}));
}

TEST(Names, OfABakeAreReplacedOrEscapedInPagesTablesAndJson) {
  const Folder folder;
  const std::string level = folder.write("level.gltf", kEmptyLevel), file = folder / "a.clamor";
  ASSERT_EQ(clamor({"bake", level, "-o", file, "--photons", "10", "--emitter",
                    "name=" + kName + ",signal=noise,at=0,1,0"})
                .code,
            0);
  const std::string page = folder / "page.html";
  ASSERT_EQ(clamor({"report", file, "-o", page, "--listener", "0,1,3"}).code, 0);
  const std::string html = read(page);
  // A line end is a blank there, and forges nothing.
  EXPECT_EQ(printable(html, Lines::kMany), html);
  EXPECT_NE(html.find("a?]0;x? ?2J"), std::string::npos);  // the name is there
  // The page's scripts would show what JSON escapes.
  const std::string json = html.substr(html.find("id=\"contents\""));
  for (const char* escaped : {"\\u001b", "\\u009b", "\\u202e"})
    EXPECT_EQ(json.substr(0, json.find("</script>")).find(escaped), std::string::npos) << escaped;

  ReportPage tables("tables", kName, kName);
  tables.table({"t", kName, {kName}, {{kName}}});
  ASSERT_TRUE(tables.write(folder / "tables").ok());
  for (const std::string name : {"tables.html", "tables.json", "tables_t.csv"})
    EXPECT_EQ(printable(read(folder / ("tables/" + name)), Lines::kMany),
              read(folder / ("tables/" + name)));
}

TEST(Names, ThatAreVeryLongAreShortenedInEveryOutput) {
  const Folder folder;
  const std::string name = "begin" + std::string(1'000'000, 'x') + "end";
  nlohmann::json level = nlohmann::json::parse(kEmptyLevel);
  level["extensionsUsed"] = {name, "KHR_audio_emitter"};
  level["scenes"][0]["nodes"] = {0};
  level["nodes"] = {{{"name", name}, {"extensions", {{"KHR_audio_emitter", {{"emitter", 0}}}}}}};
  level["extensions"]["KHR_audio_emitter"] = {
      {"audio", {{{"name", name}, {"uri", "none.wav"}}}},
      {"sources", {{{"name", name}, {"audio", 0}}}},
      {"emitters", {{{"name", name}, {"type", "positional"}, {"sources", {0}}}}}};
  const std::string path = folder.write("level.gltf", level.dump()), file = folder / "a.clamor";
  const auto failed = clamor({"bake", path, "-o", file, "--photons", "10"});
  EXPECT_EQ(failed.code, 1);  // the sound is missing
  EXPECT_LT(failed.err.size(), 10'000u);
  auto sound = WavWriter::create(folder / "none.wav", 1, 48000, SampleFormat::kFloat32);
  ASSERT_TRUE(sound.ok() && sound->write(std::vector<float>{0.5f, 0, 0}).ok() &&
              sound->finish().ok());
  const auto baked = clamor({"bake", path, "-o", file, "--photons", "10"});
  ASSERT_EQ(baked.code, 0) << baked.err.substr(0, 2000);
  EXPECT_LT(baked.err.size(), 10'000u);
  EXPECT_LT(clamor({"inspect", path}).out.size(), 10'000u);
  const auto json = clamor({"inspect", file, "--json"}).out;
  EXPECT_LT(json.size(), 100'000u);
  EXPECT_NE(json.find("\"beginx"), std::string::npos);
  EXPECT_NE(json.find("xend\""), std::string::npos);
  const auto spec =
      clamor({"bake", path, "-o", file, "--emitter", "name=" + name + ",signal=noise,at=0,1,0"});
  EXPECT_EQ(spec.code, 2);
  EXPECT_NE(spec.err.find("name= has 1000008 bytes; give at most 500"), std::string::npos);
  EXPECT_LT(spec.err.size(), 1000u);
}

TEST(Names, OfAForgedSidecarOrScriptAreShortenedInEveryOutput) {
  const Folder folder;
  const std::string name = "begin" + std::string(1'000'000, 'x') + "end";
  const std::string too_long(501, 'x');
  const std::string level = folder.write("level.gltf", kEmptyLevel), file = folder / "a.clamor";
  using nlohmann::json;
  for (const json& sidecar :
       std::vector<json>{{{name, 1}},
                         {{"materials", {{name, name}}}},
                         {{"movable", {name}}},
                         {{"emitters", {{{"name", name}, {"signal", name}, {"at", {0, 1, 0}}}}}},
                         {{"emitters", {{{"name", name}, {"removed", true}}}}},
                         {{"listeners", {{{"name", name}, {"at", {0, 1, 0}}}}}},
                         {{"portals", {{{"name", name}, {"corners", name}}}}}}) {
    folder.write("level.acoustics.json", sidecar.dump());
    const Outcome outcome = clamor({"bake", level, "-o", file, "--photons", "10", "--emitter",
                                    "name=a,signal=noise,at=0,1,0"});
    EXPECT_EQ(outcome.err.find(too_long), std::string::npos) << sidecar.dump().substr(0, 100);
  }
  folder.write("level.acoustics.json", "{}");
  ASSERT_EQ(clamor({"bake", level, "-o", file, "--photons", "10", "--emitter",
                    "name=a,signal=noise,at=0,1,0"})
                .code,
            0);
  const json unknown = {
      {"parts", {{{"name", name}, {"path", {{{"time_s", 0}, {"turn_deg", 0}}}}}}}};
  const std::string script = folder.write("moving.json", unknown.dump());
  const std::string walk = folder.write("walk.json", json{{name, 1}}.dump());
  for (const std::vector<std::string>& words :
       {std::vector<std::string>{"--moving", script}, {"--walk", walk}}) {
    const Outcome outcome = clamor({"render", file, "-o", folder / "a.wav", "--seconds", "1",
                                    "--listener", "0,1,3", words[0], words[1]});
    EXPECT_NE(outcome.code, 0) << words[0];
    EXPECT_EQ(outcome.err.find(too_long), std::string::npos) << words[0];
  }
}

TEST(Warnings, ThatAreEqualAreOneWithACount) {
  EXPECT_EQ(with_counts({"a", "b", "a", "c", "a"}),
            (std::vector<std::string>{"a (3 times)", "b", "c"}));
  const std::vector<std::string> many(100'000, "the same");
  EXPECT_EQ(with_counts(many), std::vector<std::string>{"the same (100000 times)"});
}

}  // namespace
}  // namespace clamor::testing
