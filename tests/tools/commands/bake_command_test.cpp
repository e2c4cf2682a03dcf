#include <nlohmann/json.hpp>

#include "formats/bake_file/bake_file.h"
#include "formats/bake_file/bake_metadata.h"
#include "tests/box_level.h"
#include "tests/build_paths.h"
#include "tests/rooms.h"
#include "tests/tools/run_clamor.h"
#include "tools/commands/bake_summary.h"

namespace clamor {
namespace {

using testing::clamor;
using testing::Folder;

TEST(BakeSummary, TellsTheDecayTimeOfARoom) {
  Level level = testing::shoebox({5, 4, 3}, testing::uniform_material(0.2f), {1.3, 1.7, 1.1});
  level.air.humidity_percent = 90;  // little loss at low frequencies
  const auto contents = bake(level, {.settings = {.sources = 100000}});
  ASSERT_TRUE(contents.ok());
  const DecaySummary& decay = contents->statistics.decay;
  EXPECT_EQ(decay.places, 4u);
  // The integral equation gives 0.481 s for Lambertian walls without air. Air takes 0.3 % at 125
  // Hz; T30 at one place from 100 000 sources varies by 1 %.
  EXPECT_NEAR(decay.t30_s[1] / 0.481, 1, 0.02);
}

TEST(BakeSummary, SaysNothingOfDecaysWhereThereAreNone) {
  Level level = testing::shoebox({5, 4, 3}, testing::uniform_material(1), {1.3, 1.7, 1.1});
  const auto dry = bake(level, {.settings = {.photons = 1000}});
  ASSERT_TRUE(dry.ok());
  for (const float t30_s : dry->statistics.decay.t30_s) EXPECT_EQ(t30_s, 0);
  level.mesh = {};
  const auto field = bake(level, {.settings = {.photons = 1000}});
  ASSERT_TRUE(field.ok());
  EXPECT_EQ(field->statistics.decay.places, 0u);
}

TEST(BakeCommand, SaysWhatTheLevelIsAndWhatSimplifyingDidToIt) {
  const Folder folder;
  const auto bake = [&](std::vector<std::string> more) {
    std::vector<std::string> words = {
        "bake",        std::string(testing::kSourceDir) + "/assets/levels/violin_room.glb",
        "-o",          folder / "out.clamor",
        "--photons",   "1000",
        "--sources",   "1000",
        "--no-journal"};
    words.insert(words.end(), more.begin(), more.end());
    return clamor(words);
  };
  const auto plain = bake({});
  EXPECT_NE(plain.err.find("closed: none of "), std::string::npos) << plain.err;
  EXPECT_EQ(plain.err.find("simplified"), std::string::npos) << plain.err;
  const auto simple = bake({"--simplify", "0.05"});
  ASSERT_EQ(simple.code, 0) << simple.err;
  EXPECT_NE(simple.err.find("simplified within 5 cm: "), std::string::npos) << simple.err;
  EXPECT_NE(simple.err.find(" triangles instead of 5952, area "), std::string::npos) << simple.err;
  const auto shown = clamor({"inspect", folder / "out.clamor"});
  EXPECT_NE(shown.out.find("--simplify 0.05"), std::string::npos) << shown.out;
  for (const char* wrong : {"-1", "11", "a"}) EXPECT_EQ(bake({"--simplify", wrong}).code, 2);
}

TEST(BakeCommand, ThatEndedAtAnErrorIsMadeAgainByTheCommandThatInspectPrints_NoAsan) {
  const Folder folder;
  const std::string level = std::string(testing::kSourceDir) + "/assets/levels/violin_room.glb";
  const std::string once = folder / "once.clamor", again = folder / "again.clamor";
  const auto outcome = clamor({"bake", level, "-o", once, "--until", "1dB"});
  ASSERT_EQ(outcome.code, 0) << outcome.err;
  EXPECT_EQ(outcome.err.find("warning"), std::string::npos) << outcome.err;
  const auto shown = clamor({"inspect", once});
  const std::size_t place = shown.out.find("clamor bake violin_room.glb -o once.clamor ");
  ASSERT_NE(place, std::string::npos) << shown.out;
  std::istringstream words(shown.out.substr(place, shown.out.find('\n', place) - place));
  std::vector<std::string> command;
  for (std::string word; words >> word;) command.push_back(word);
  ASSERT_EQ(command.size(), 9u);
  command.erase(command.begin());
  command[1] = level;
  command[3] = again;
  const auto second = clamor(command);
  ASSERT_EQ(second.code, 0) << second.err;
  EXPECT_TRUE(testing::read(once) == testing::read(again));
  for (const char* wrong : {"0.5", "0dB", "x"})
    EXPECT_EQ(clamor({"bake", level, "-o", once, "--until", wrong}).code, 2);
  EXPECT_EQ(clamor({"bake", level, "-o", once, "--until", "1dB", "--photons", "100"}).code, 2);
}

TEST(BakeCommand, FitsAbsorptionToMeasuredTimesInASidecarThatItReads) {
  const Folder folder;
  const std::string level =
      testing::level_of(folder, testing::box({4, 3, 5}), R"(, "materials": [{"name": "walls"}])",
                        R"(, "material": 0)");
  const std::string start = folder.write("start.json", R"({
    "materials": {"walls": {"preset": "plaster", "scattering": 0.7}, "roof*": "wood"},
    "emitters": [{"name": "S", "signal": "impulse", "at": [1, 1.2, 1]}],
    "settings": {"air": {"temperature_c": 19}}})");
  const auto fit = [&](const std::string& measured, std::vector<std::string> more = {}) {
    std::vector<std::string> words = {"bake",        level,
                                      "--acoustics", start,
                                      "--measured",  folder.write("measured.json", measured),
                                      "-o",          folder / "box.acoustics.json",
                                      "--sources",   "20000"};
    words.insert(words.end(), more.begin(), more.end());
    return clamor(words);
  };
  const auto fitted = fit(R"({"bandsHz": [500, 1000], "t30_s": [0.9, 0.8]})");
  ASSERT_EQ(fitted.code, 0) << fitted.err;
  EXPECT_NE(fitted.err.find("walls, 94.0 m2"), std::string::npos) << fitted.err;
  const auto sidecar = nlohmann::json::parse(testing::read(folder / "box.acoustics.json"));
  EXPECT_EQ(sidecar["settings"]["air"]["temperature_c"], 19);
  EXPECT_EQ(sidecar["emitters"].size(), 1u);
  EXPECT_EQ(sidecar["materials"]["roof*"], "wood");
  EXPECT_EQ(sidecar["materials"]["walls"]["scattering"][4], 0.7);
  // The bake reads it; the seed is another.
  const std::string out = folder / "box.clamor";
  const auto baked = clamor({"bake", level, "-o", out, "--sources", "40000", "--seed", "5"});
  ASSERT_EQ(baked.code, 0) << baked.err;
  const auto shown = nlohmann::json::parse(clamor({"inspect", out, "--json"}).out);
  const auto& decay = shown["decay"];
  for (const auto& [band, time_s] : {std::pair(3, 0.9), {4, 0.8}}) {
    const double error_s = decay["t30_error_s"][band];
    EXPECT_LT(error_s, 0.05);
    // Four standard errors of this bake and of the fit, which has half its sources.
    EXPECT_NEAR(decay["t30_s"][band].get<double>(), time_s, 4 * 1.8 * error_s);
  }
  EXPECT_EQ(decay["materials"][0]["name"], "walls");
  EXPECT_LT(decay["materials"][0]["t30_slope_s"][4].get<double>(), 0);

  for (const auto& [measured, says] :
       {std::pair(R"({"bandsHz": [1000], "t30_s": [0.1]})", "at 1000 Hz no absorption within"),
        {R"({"bandsHz": [1000]})", "needs 't30_s' or 't20_s'"},
        {R"({"bandsHz": [500, 1000], "t20_s": [1]})", "a value for each"},
        {R"({"bandsHz": [1000], "t20_s": [0]})", "values from 0.001 to 100"},
        {R"({"bandsHz": [1000, 1000], "t20_s": [1, 2]})", "each greater than the one before"},
        {R"({"bandsHz": [31.5], "t20_s": [1]})", "no value at the centre"},
        {R"({"t30": [1]})", "needs 't30_s'"}}) {
    const auto refused = fit(measured);
    EXPECT_EQ(refused.code, 1);
    EXPECT_NE(refused.err.find(says), std::string::npos) << refused.err;
  }
  const std::string good = R"({"bandsHz": [1000], "t30_s": [0.8]})";
  EXPECT_EQ(fit(good, {"--until", "1dB"}).code, 2);
  const auto wrong = clamor({"bake", level, "--acoustics", start, "--measured",
                             folder / "measured.json", "-o", folder / "fit.clamor"});
  EXPECT_EQ(wrong.code, 1);
  EXPECT_NE(wrong.err.find("sidecars end in .acoustics.json"), std::string::npos) << wrong.err;
  const std::string both = folder.write("both.acoustics.json", good);
  EXPECT_EQ(clamor({"bake", level, "--acoustics", start, "--measured", both, "-o", both}).code, 1);
  EXPECT_EQ(testing::read(both), good);
}

TEST(BakeCommand, ReportsProgressAsJsonLinesForBuildSystems) {
  const Folder folder;
  const auto outcome = clamor(
      {"bake", std::string(testing::kSourceDir) + "/assets/levels/violin_room.glb", "-o",
       folder / "out.clamor", "--photons", "40000", "--sources", "5000", "--progress", "json"});
  ASSERT_EQ(outcome.code, 0) << outcome.err;
  std::istringstream lines(outcome.err);
  std::string line, last;
  std::uint64_t photons = 0;
  while (std::getline(lines, line)) {
    const auto json = nlohmann::json::parse(line);
    if (json["stage"] == "level") {
      EXPECT_EQ(json["triangles"], 5952);
      EXPECT_EQ(json["escaped_power_share"], 0);
      continue;
    }
    EXPECT_GE(json["photons"].get<std::uint64_t>(), photons);
    photons = json["photons"];
    last = json["stage"];
    if (last == "done") {
      EXPECT_GT(json["error_db"].get<double>(), 0.1);
      EXPECT_LT(json["error_db"].get<double>(), 3);
    }
  }
  EXPECT_EQ(last, "done");
  EXPECT_EQ(photons, 40000u);
  EXPECT_EQ(clamor({"bake", "x.glb", "-o", folder / "y", "--progress", "xml"}).code, 2);
}

TEST(MaterialsCommand, ListsEveryPresetWithItsFiguresAndTheirSource) {
  const auto json = testing::clamor({"materials", "--json"});
  ASSERT_EQ(json.code, 0);
  const auto list = nlohmann::json::parse(json.out);
  const auto table = testing::clamor({"materials"}).out;
  EXPECT_EQ(list.size(), 38u);
  for (const auto& preset : list) {
    EXPECT_EQ(preset["absorption"].size(), 8u);
    EXPECT_FALSE(preset["source"].get<std::string>().empty());
    EXPECT_NE(table.find("\n" + preset["name"].get<std::string>() + " "), std::string::npos);
  }
  EXPECT_EQ(testing::clamor({"materials", "--name", "velvet"}).out, "velvet -> curtain\n");
}

// Bakes the violin room with its emitter 40 m outside, with few photons.
testing::Outcome bake_outside(const Folder& folder, const std::string& name,
                              std::vector<std::string> more) {
  more.insert(more.begin(),
              {"bake", testing::violin_room(), "-o", folder / name, "--emitter",
               "name=violin,signal=noise,at=44,1.5,0", "--photons", "100", "--no-journal"});
  return clamor(more);
}

TEST(BakeWarnings, AreInTheFileAndInEveryKindOfOutput) {
  const Folder folder;
  const std::string told = "emitter 'violin' lies outside the level";
  const auto words = bake_outside(folder, "words.clamor", {});
  const auto quiet = bake_outside(folder, "quiet.clamor", {"--quiet"});
  const auto lines = bake_outside(folder, "json.clamor", {"--progress", "json"});
  for (const auto* outcome : {&words, &quiet, &lines}) EXPECT_EQ(outcome->code, 0) << outcome->err;

  for (const auto* outcome : {&words, &quiet}) {
    const std::size_t once = outcome->err.find("  warning  " + told);
    ASSERT_NE(once, std::string::npos) << outcome->err;
    EXPECT_EQ(outcome->err.find(told, once + 20), std::string::npos) << outcome->err;
  }
  EXPECT_TRUE(quiet.err.starts_with("  warning  ")) << quiet.err;
  EXPECT_EQ(quiet.err.find('\n'), quiet.err.size() - 1) << quiet.err;

  std::istringstream all(lines.err);
  std::size_t warnings = 0;
  for (std::string line; std::getline(all, line);) {
    const auto json = nlohmann::json::parse(line);
    if (json["stage"] == "warning") {
      ++warnings;
      EXPECT_EQ(json["text"].get<std::string>().find(told), 0u) << line;
    }
    if (json["stage"] == "done") {
      EXPECT_EQ(json["warnings"], 1) << line;
    }
  }
  EXPECT_EQ(warnings, 1u) << lines.err;

  const auto file =
      nlohmann::json::parse(clamor({"inspect", folder / "quiet.clamor", "--json"}).out);
  ASSERT_EQ(file["warnings"].size(), 1u);
  EXPECT_EQ(file["warnings"][0].get<std::string>().find(told), 0u);
  EXPECT_NE(clamor({"inspect", folder / "quiet.clamor"}).out.find("warning: " + told),
            std::string::npos);
  EXPECT_TRUE(testing::read(folder / "words.clamor") == testing::read(folder / "json.clamor"));
}

TEST(BakeWarnings, AreErrorsWhenAskedForAndThenNothingIsWritten) {
  const Folder folder;
  const auto outcome = bake_outside(folder, "out.clamor", {"--strict", "--quiet"});
  EXPECT_EQ(outcome.code, 1);
  EXPECT_NE(
      outcome.err.find("1 warning above, and --strict treats warnings as errors; nothing was"),
      std::string::npos)
      << outcome.err;
  EXPECT_TRUE(folder.names().empty());
  // This warning is known only after the tracing.
  const auto late = clamor({"bake", testing::violin_room(), "-o", folder / "out.clamor",
                            "--photons", "100", "--longest", "0.05", "--strict", "--no-journal"});
  EXPECT_EQ(late.code, 1) << late.err;
  EXPECT_NE(late.err.find(" % of the power was still under way"), std::string::npos) << late.err;
  EXPECT_TRUE(folder.names().empty());
  // Without warnings, --strict changes nothing.
  const auto fine = clamor({"bake", testing::violin_room(), "-o", folder / "out.clamor",
                            "--photons", "100", "--strict", "--no-journal"});
  EXPECT_EQ(fine.code, 0) << fine.err;
  EXPECT_EQ(folder.names(), std::vector<std::string>{"out.clamor"});
}

// A cube of 60 m of concrete decays for more than a minute.
TEST(BakeCommand, SaysHowLongItsPathsAreAndTakesTheLengthThatIsGiven) {
  const Folder folder;
  const std::string level = testing::level_of(folder, testing::box({60, 60, 60}));
  const auto bake = [&](std::vector<std::string> more) {
    more.insert(more.begin(), {"bake", level, "-o", folder / "hall.clamor", "--no-journal",
                               "--material", "concrete", "--photons", "64", "--sources", "500",
                               "--emitter", "name=click,signal=impulse,at=9,7,5"});
    const auto outcome = clamor(more);
    EXPECT_EQ(outcome.code, 0) << outcome.err;
    const auto file = BakeFile::open(folder / "hall.clamor");
    return std::pair(outcome.err, file.ok() ? file->settings().longest_path_s : 0.0);
  };
  const auto [chosen, longest_s] = bake({});
  EXPECT_EQ(longest_s, 60);
  EXPECT_NE(chosen.find("so slow that paths of up to 60 s were traced"), std::string::npos)
      << chosen;
  const auto [given, given_s] = bake({"--longest", "10"});
  EXPECT_EQ(given_s, 10);
  EXPECT_EQ(given.find("so slow that"), std::string::npos) << given;
  EXPECT_NE(given.find("so the reverberation ends early; --longest 60 traces more"),
            std::string::npos)
      << given;
}

TEST(BakeCommand, EndsWithALineThatAShellTakesForOneFile) {
  const Folder folder;
  const auto outcome = clamor({"bake", testing::violin_room(), "-o", folder / "my hall's.clamor",
                               "--photons", "100", "--no-journal"});
  ASSERT_EQ(outcome.code, 0) << outcome.err;
  EXPECT_TRUE(outcome.err.ends_with("clamor play '" + (folder / "my hall'\\''s.clamor") + "'\n"))
      << outcome.err;
}

TEST(BakeCommand, SaysWhatTheJournalSpared) {
  const Folder folder;
  const auto bake = [&](std::vector<std::string> more) {
    more.insert(more.begin(), {"bake", testing::violin_room(), "-o", folder / "out.clamor",
                               "--photons", "5000", "--sources", "1000"});
    return clamor(more).err;
  };
  const std::string none = "reused   nothing of ";
  const auto has = [](const std::string& text, const std::string& part) {
    return text.find(part) != std::string::npos;
  };
  const std::string keep = "--keep-journal", journal = folder / "out.clamor.journal";
  const std::string first = bake({keep});
  EXPECT_FALSE(has(first, "reused")) << first;
  EXPECT_TRUE(has(first, "traces only emitters that moved")) << first;
  const std::string second = bake({keep});
  EXPECT_TRUE(has(second, "reused   5000 of 5000 photons")) << second;
  const std::string other = bake({"--kappa", "0.2", keep});
  EXPECT_TRUE(has(other, none)) << other;
  EXPECT_TRUE(std::filesystem::exists(journal));
}

// It is several times as large as the bake.
TEST(BakeCommand, RemovesTheJournalOfACompleteBakeAndSaysSo) {
  const Folder folder;
  std::vector<std::string> words = {
      "bake", testing::violin_room(), "-o", folder / "out.clamor", "--photons", "500", "--sources",
      "1000"};
  const auto outcome = clamor(words);
  EXPECT_EQ(outcome.code, 0) << outcome.err;
  EXPECT_EQ(folder.names(), std::vector<std::string>{"out.clamor"});
  EXPECT_NE(outcome.err.find("  removed  " + (folder / "out.clamor.journal") + " ("),
            std::string::npos)
      << outcome.err;
  words.insert(words.end(), {"--keep-journal", "--no-journal"});
  EXPECT_EQ(clamor(words).code, 2);
}

TEST(ListenerWarnings, SayWithMovingSourcesWhoIsOutsideTheLevel_NoAsan) {
  const Folder folder;
  const std::string bake = folder / "room.clamor";
  ASSERT_EQ(clamor({"bake", testing::violin_room(), "-o", bake, "--photons", "300", "--sources",
                    "1000", "--quiet", "--no-journal"})
                .code,
            0);
  const auto warnings = [&](const std::string& listener, const std::string& source_m) {
    const std::string script = folder.write(
        "moving.json", R"({"sources": [{"name": "car", "path": {"points": [)"
                       R"({"time_s": 0, "position_m": [0, 1, 2]}, {"time_s": 0.1, "position_m": )" +
                           source_m + "}]}}]}");
    const auto rendered = clamor({"render", bake, "-o", folder / "out.wav", "--receivers", "omni",
                                  "--seconds", "0.1", "--listener", listener, "--moving", script});
    EXPECT_EQ(rendered.code, 0) << rendered.err;
    const auto played = clamor({"play", bake, "--device", "none", "--seconds", "0.1", "--receivers",
                                "omni", "--listener", listener, "--moving", script});
    std::string lines, line;
    for (std::istringstream all(rendered.err); std::getline(all, line);)
      if (line.find("outside") != std::string::npos) {
        lines += line;
        EXPECT_NE(played.err.find(line), std::string::npos) << played.err;
      }
    return lines;
  };
  EXPECT_EQ(warnings("0,1.7,3", "[1, 1, 2]"), "");
  EXPECT_NE(warnings("44,1.5,0", "[1, 1, 2]")
                .find("warning: the listener at 44,1.5,0 is outside the level, which lies between"),
            std::string::npos);
  const std::string source = warnings("0,1.7,3", "[0, 64, 2]");
  EXPECT_NE(source.find("warning: moving source 'car' at 0,"), std::string::npos) << source;
  EXPECT_NE(source.find("s into the script)"), std::string::npos) << source;
}

TEST(ListenerWarnings, OfEveryCommandSayWhyNothingIsHeardAndWhereSomethingIs_NoAsan) {
  const Folder folder;
  const std::string bake = folder / "room.clamor";
  ASSERT_EQ(clamor({"bake", testing::violin_room(), "-o", bake, "--photons", "1000", "--sources",
                    "5000", "--quiet", "--no-journal"})
                .code,
            0);
  const auto render = [&](const std::vector<std::string>& listener) {
    std::vector<std::string> words = {"render",      bake,   "-o",        folder / "out.wav",
                                      "--receivers", "omni", "--seconds", "0.1"};
    words.insert(words.end(), listener.begin(), listener.end());
    return clamor(words);
  };
  const std::string outside = "44,1.5,0";
  const std::string reason =
      "hardly anything is heard at 44,1.5,0: the listener is outside the level, which is closed";
  const auto silent = render({"--listener", outside});
  EXPECT_EQ(silent.code, 0) << silent.err;
  EXPECT_NE(silent.err.find("warning: " + reason), std::string::npos) << silent.err;
  const auto played = clamor({"play", bake, "--device", "none", "--seconds", "0.1", "--listener",
                              outside, "--receivers", "omni"});
  EXPECT_NE(played.err.find("warning: " + reason), std::string::npos) << played.err;
  const auto impulse = clamor({"impulse", bake, "--listener", outside});
  EXPECT_EQ(impulse.code, 0) << "the windows let a little through";
  EXPECT_NE(impulse.err.find(reason), std::string::npos) << impulse.err;

  // The proposed position is audible.
  const std::string before = "where an emitter is heard is ";
  const std::size_t begin = silent.err.find(before) + before.size();
  const std::string place = silent.err.substr(begin, silent.err.find('\n', begin) - begin);
  const auto heard = render({"--listener", place});
  EXPECT_EQ(heard.code, 0) << heard.err;
  EXPECT_EQ(heard.err.find("warning"), std::string::npos) << heard.err;
  EXPECT_EQ(heard.err.find(" 0 voices"), std::string::npos) << heard.err;

  // Without occlusion, only distance counts.
  const auto open = render({"--listener", outside, "--visibility", "off"});
  EXPECT_EQ(open.err.find("warning"), std::string::npos) << open.err;
  const auto far = render({"--listener", "1e9,0,0", "--visibility", "off"});
  EXPECT_NE(far.err.find("too far from every emitter"), std::string::npos) << far.err;

  // The walk leaves the room half way.
  const auto walk = folder.write(
      "walk.json",
      R"({"points": [{"time_s": 0, "position_m": [0, 1.7, 3]}, {"time_s": 0.1, "position_m": [12, 1.7, 3]}]})");
  const auto left = render({"--walk", walk});
  EXPECT_NE(left.err.find("s into the walk; of 33 positions tested along it"), std::string::npos)
      << left.err;
}

}  // namespace
}  // namespace clamor
