// Tests that every experiment runs on a small bake and writes what it promises.
#include "tools/experiments/experiments.h"

#include <algorithm>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "tests/box_level.h"
#include "tests/build_paths.h"
#include "tests/tools/drawn_page.h"

namespace clamor::testing {
namespace {

class Experiment : public ::testing::TestWithParam<const char*> {};

// The bake that all experiments run on: the violin room, because it is small.
std::string baked_level(const Folder& folder, std::vector<std::string> more = {}) {
  // Strategies of the paper test no occlusion, without which image sources are not heard.
  std::vector<std::string> words = {
      "bake", violin_room(),   "-o", folder / "room.clamor", "--sources",
      "1000", "--early-order", "0",  "--no-journal"};
  words.insert(words.end(), more.begin(), more.end());
  const Outcome bake = clamor(words);
  EXPECT_EQ(bake.code, 0) << bake.err;
  return folder / "room.clamor";
}

TEST_P(Experiment, WritesAPageThatNeedsNothingElseAndItsTables) {
  const Folder folder;
  const std::string name = GetParam(), report = folder / "report";
  const Outcome run = clamor({"experiment", name, baked_level(folder), "-o", report, "--quick"});
  ASSERT_EQ(run.code, 0) << run.err;
  const std::string file = report + "/" + name + ".html", page = read(file);
  for (const char* const elsewhere : {"src=", "href=", "url("})
    EXPECT_EQ(page.find(elsewhere), std::string::npos) << elsewhere;
  // The page names this bake, not the level of the paper, and claims only what its tables hold.
  EXPECT_NE(page.find("room.clamor"), std::string::npos);
  for (const char* const claimed :
       {"<title>The ", "right level at every k", "is right at every", "Both are so", "So they do",
        "So it does", "same is seen here", "off by many dB", "the octree does not"})
    EXPECT_EQ(page.find(claimed), std::string::npos) << claimed;
  const auto json = nlohmann::json::parse(read(report + "/" + name + ".json"));
  EXPECT_EQ(json["experiment"], name);
  ASSERT_FALSE(json["tables"].empty());
  for (const auto& [table, rows] : json["tables"].items()) {
    const std::string csv = read(report + "/" + name + "_" + table + ".csv");
    ASSERT_FALSE(rows.empty()) << table;
    EXPECT_EQ(static_cast<std::size_t>(std::count(csv.begin(), csv.end(), '\n')), rows.size() + 1);
  }
  if (!has_node()) GTEST_SKIP() << "the page was not drawn; not on this machine: node";
  const std::string shown = drawn(file);
  EXPECT_NE(shown.find("<svg"), std::string::npos);
  EXPECT_NE(shown.find("The paper"), std::string::npos);
  for (const char* const no_figure : {"nan", "inf", "NaN", "Infinity", "undefined"})
    EXPECT_EQ(shown.find(no_figure), std::string::npos) << no_figure;
}

INSTANTIATE_TEST_SUITE_P(Each, Experiment,
                         ::testing::Values("stadium", "violin", "octave-bands", "convergence",
                                           "walk", "motion", "field"),
                         [](const auto& one) {
                           std::string name = one.param;
                           std::replace(name.begin(), name.end(), '-', '_');
                           return name;
                         });

TEST(Experiments, OfSeedsJudgeEachParameterOfEnergiesAndOfAWaveform) {
  const Folder folder;
  const std::string report = folder / "report";
  // The walls transmit nothing, since sound that comes back through them decays more slowly.
  const std::string acoustics = folder.write("opaque.json", R"({"materials": {
      "parquet": {"preset": "wood_floor", "transmission": 0},
      "wall_plaster": {"preset": "plaster", "transmission": 0},
      "wall_panelling": {"preset": "wood", "transmission": 0},
      "window_glass": {"preset": "glass_double", "transmission": 0},
      "door_leaf": {"preset": "door", "transmission": 0},
      "ceiling_frame": {"preset": "plasterboard", "transmission": 0},
      "ceiling_lights": {"preset": "glass", "transmission": 0}}})");
  const std::string level = baked_level(folder, {"--acoustics", acoustics});
  const Outcome run = clamor({"experiment", "seeds", level, "-o", report, "--quick"});
  ASSERT_EQ(run.code, 0) << run.err;
  const auto tables = nlohmann::json::parse(read(report + "/seeds.json"))["tables"];
  EXPECT_EQ(tables["shift"].size(), 12u);
  ASSERT_EQ(tables["spread"].size(), 26u);
  // In the octave of 1 kHz, decaying noise has thousands of independent samples per second.
  for (const std::size_t i : {24, 25}) {
    const auto& row = tables["spread"][i];
    EXPECT_EQ(row["of"], "decaying noise");
    EXPECT_GT(row["1000_hz"], 0.01) << row;
    EXPECT_LT(row["1000_hz"], 5) << row;
  }
  for (std::size_t i = 0; i < 24; ++i) {
    const auto& row = tables["spread"][i];
    EXPECT_EQ(row["photons"], i % 2 == 0 ? 1000 : 4000);
    // 400 sources know a band's level to about a decibel.
    if (row["parameter"] != "G") continue;
    EXPECT_GT(row["1000_hz"], 0.001) << row;
    EXPECT_LT(row["1000_hz"], 5) << row;
  }
}

// Each exchange uses up one factor epsilon of the changes of a weight. New sources start counting
// at zero, so there are fewer exchanges, but not many fewer while steps are small against epsilon.
TEST(Experiments, OfAWalkFindThatAdaptiveDiffusionExchangesNoMoreThanItsRuleAsksFor) {
  const Folder folder;
  const std::string report = folder / "report";
  const Outcome run =
      clamor({"experiment", "walk", baked_level(folder), "-o", report, "--quick", "--quiet"});
  ASSERT_EQ(run.code, 0) << run.err;
  EXPECT_EQ(run.err, "");
  const auto rows = nlohmann::json::parse(read(report + "/walk.json"))["tables"]["adaptive"];
  ASSERT_EQ(rows.size(), 3u);
  for (const auto& row : rows) {
    const double exchanged = row["exchanged_percent_per_m"], due = row["due_percent_per_m"];
    EXPECT_LE(exchanged, due);
    if (row["speed_mps"] == 1.5) {
      EXPECT_GT(exchanged, 0.2 * due);
    }
  }
}

// The listener walks, runs and flies. The sound is played from the file, as the player does.
TEST(Experiments, OfMotionFindNoClicksBeyondThoseOfAllSources) {
  const Folder folder;
  const std::string report = folder / "report";
  const Outcome run =
      clamor({"experiment", "motion", baked_level(folder), "-o", report, "--quick"});
  ASSERT_EQ(run.code, 0) << run.err;
  const auto json = nlohmann::json::parse(read(report + "/motion.json"));
  std::vector<double> speeds_mps;
  for (const auto& row : json["tables"]["clicks"]) {
    speeds_mps.push_back(row["speed_mps"]);
    EXPECT_GE(row["seconds"], 2);
    EXPECT_EQ(row["clicks_beyond_all"], 0) << row;
  }
  EXPECT_EQ(speeds_mps, (std::vector<double>{1.5, 5, 30}));
}

TEST(Experiments, NameEachSampleSizeAtWhichThePaperIsBetter) {
  EXPECT_EQ(at_every_k_except({}), "at every k");
  const std::vector<WorseThanPaper> defeats = {
      {128, 0.92, 0.87}, {512, 0.5, 0.4}, {1024, 0.3, 0.2}};
  EXPECT_EQ(at_every_k_except(std::span(defeats).first(1)),
            "at every k but 128 (0.92, the best of the paper's 0.87)");
  EXPECT_EQ(at_every_k_except(defeats),
            "at every k but 128 (0.92, the best of the paper's 0.87), 512 (0.50, the best of the "
            "paper's 0.40) and 1024 (0.30, the best of the paper's 0.20)");
}

using Row = std::vector<ReportTable::Cell>;

Row waveform(const char* strategy, double k, double level_db, double l2, double renormalised) {
  return {strategy,    strategy == std::string("priority") ? "power" : "amplitude", k, level_db, l2,
          renormalised};
}

// A priority sampler that is worse everywhere is reported as such.
TEST(Experiments, SayOfFigure4WhatItsTableHolds) {
  ReportTable table{"figure_4", "", {}, {}};
  table.columns = {"strategy", "estimator", "k", "loudness_db", "l2", "renormalised_l2"};
  table.rows = {
      waveform("octree", 32, 9.1, 4, 1.2),      waveform("octree", 128, 6, 2, 1.2),
      waveform("octree", 512, 3, 1, 1.2),       waveform("priority", 32, -1.571, 1.4, 1.3),
      waveform("priority", 128, 0.2, 1.3, 1.3), waveform("priority", 512, 0.1, 1.2, 1.25)};
  const std::string text = figure_4_text(table);
  for (const char* const part :
       {"From k = 32 to 512, the octree's absolute error goes as k^-0.50 and its renormalised "
        "error as k^",
        "up to 1.57 dB off the level of all sources (-1.57 dB at k = 32)",
        "up to 9.10 dB off (+9.10 dB, octree at k = 32)",
        "nowhere below the best of the paper's strategies"})
    EXPECT_NE(text.find(part), std::string::npos) << text;
  table.rows[5] = waveform("priority", 512, 0.1, 1.2, 1.1);
  EXPECT_NE(figure_4_text(table).find(
                "below the best of the paper's strategies at every k but 128 (1.30, the best of"),
            std::string::npos);
  // Without a k of at least 128, no comparison is made.
  table.rows = {waveform("octree", 32, 9.1, 4, 1.2), waveform("priority", 32, -1.571, 1.4, 1.3)};
  const std::string little = figure_4_text(table);
  EXPECT_EQ(little.find("128"), std::string::npos) << little;
  EXPECT_EQ(little.find("k^"), std::string::npos) << little;
}

TEST(Experiments, SayOfTheOthersWhatTheirTablesHold) {
  ReportTable loudness{"loudness", "", {}, {}};
  loudness.columns = {"strategy", "estimator", "k", "loudness_db", "l2"};
  loudness.rows = {{"octree", "amplitude", 32.0, 5.0, 2.0},
                   {"octree", "power", 32.0, 0.0, 1.0},
                   {"random", "amplitude", 32.0, 7.5, 3.0},
                   {"priority", "power", 32.0, -0.75, 1.0}};
  const std::string levels = convergence_text(loudness);
  EXPECT_NE(levels.find("5.00 to 7.50 dB louder than all sources at k = 32"), std::string::npos)
      << levels;
  EXPECT_NE(levels.find("within 0.75 dB"), std::string::npos) << levels;

  ReportTable bands{"bands", "", {}, {}};
  bands.columns = {"bands", "k", "63_hz", "125_hz"};
  bands.rows = {{"apart (paper)", 150.0, 3.0, 9.0}, {"in one source (priority)", 150.0, 0.5, 0.25}};
  EXPECT_EQ(
      bands_text(bands),
      "apart (paper), k = 150: up to 9.00 dB off (125_hz); in one source (priority), k = 150: "
      "up to 0.50 dB off (63_hz).");

  ReportTable violin{"figure_6", "", {}, {}};
  violin.columns = {"reflection", "strategy", "k", "steps_rms_by_energy_db"};
  violin.rows = {{"diffuse", "octree", 50.0, 4.0},
                 {"diffuse", "octree", 200.0, 2.0},
                 {"diffuse", "importance", 50.0, 9.0},
                 {"diffuse", "priority", 50.0, 3.0},
                 {"Phong 20", "octree", 50.0, 6.0}};
  EXPECT_NE(figure_6_text(violin).find(
                "diffuse: octree 4.0 dB at k = 50, 2.0 dB at k = 200; priority 3.0 dB at k = 50. "
                "Phong 20: octree 6.0 dB at k = 50."),
            std::string::npos)
      << figure_6_text(violin);
}

TEST(Experiments, FitThePowerLawThatIsThere) {
  EXPECT_NEAR(fitted_exponent({1, 4, 16}, {8, 4, 2}).value_or(0), -0.5, 1e-12);
  EXPECT_FALSE(fitted_exponent({4}, {2}).has_value());
  EXPECT_FALSE(fitted_exponent({4, 4}, {2, 3}).has_value());
  EXPECT_FALSE(fitted_exponent({1, 4}, {2, 0}).has_value());
  EXPECT_EQ(listed({"a"}), "a");
  EXPECT_EQ(listed({"a", "b", "c"}), "a, b and c");
  EXPECT_EQ(range_text({2, 1.26}, 1), "1.3 to 2.0");
  EXPECT_EQ(range_text({2, 2.01}, 1), "2.0");
}

// With few sources the axis ends before most zones, whose labels once overprinted each other at its
// end.
TEST(Charts, LabelOnlyZonesThatThereIsRoomFor) {
  if (!has_node()) GTEST_SKIP() << "not on this machine: node";
  Chart chart{.log_x = true,
              .zones = {{32, 181, "one"}, {1448, 4096, "two"}, {6000, 9000, "three"}}};
  chart.series = {{.name = "a", .points = {{32, 1}, {128, 2}}}};
  const Folder folder;
  const auto to_svg = [&] {
    ReportPage page("zones", "Zones", "");
    page.chart(chart, "");
    EXPECT_TRUE(page.write(folder.path()).ok());
    return drawn(folder / "zones.html");
  };
  const std::string narrow = to_svg();
  EXPECT_NE(narrow.find(">one<"), std::string::npos);
  EXPECT_EQ(narrow.find(">two<"), std::string::npos);
  EXPECT_EQ(narrow.find(">three<"), std::string::npos);
  chart.series[0].points.back().first = 16384;
  EXPECT_NE(to_svg().find(">two<"), std::string::npos);
  chart.zones[2].label = "a label that is far too long for a zone as narrow as this";
  EXPECT_EQ(to_svg().find("a label"), std::string::npos);
}

// A room that was measured from 125 Hz on had a line and a label for 63 Hz left of its chart.
TEST(Charts, HaveNoTicksBesideTheirPoints) {
  if (!has_node()) GTEST_SKIP() << "not on this machine: node";
  const Folder folder;
  ReportPage page("ticks", "Ticks", "");
  page.chart({.log_x = true,
              .x_ticks = {63, 125, 250},
              .series = {{.name = "a", .points = {{125, 1}, {250, 2}}}}},
             "");
  ASSERT_TRUE(page.write(folder.path()).ok());
  const std::string svg = drawn(folder / "ticks.html");
  EXPECT_NE(svg.find(">125<"), std::string::npos);
  EXPECT_EQ(svg.find(">63<"), std::string::npos);
}

TEST(Experiments, AreTheSameEachTime) {
  const Folder folder;
  const std::string level = baked_level(folder);
  for (const std::string report : {"a", "b"})
    ASSERT_EQ(clamor({"experiment", "octave-bands", level, "-o", folder / report, "--quick"}).code,
              0);
  EXPECT_EQ(read(folder / "a" + "/octave-bands.html"), read(folder / "b" + "/octave-bands.html"));
}

TEST(Experiments, RefuseWhatTheyCannotDoAndSayWhatThereIs) {
  const Folder folder;
  const Outcome unknown = clamor({"experiment", "stadion", "x.clamor", "-o", folder / "r"});
  EXPECT_EQ(unknown.code, 2);
  EXPECT_NE(unknown.err.find("'stadium'"), std::string::npos) << unknown.err;
  EXPECT_EQ(clamor({"experiment", "walk", folder / "none.clamor", "-o", folder / "r"}).code, 1);
  EXPECT_EQ(clamor({"experiment", "walk", "x.clamor"}).code, 2);
  EXPECT_EQ(clamor({"experiment", "walk", "x.clamor", "-o", "r", "--null", "3"}).code, 2);
  EXPECT_TRUE(folder.names().empty());
}

TEST(Experiments, RefuseABakeOfProbesWithoutEmitters) {
  const Folder folder;
  const std::string bake = folder / "probes.clamor";
  const Outcome baked = clamor({"bake", box_level(folder), "-o", bake, "--material", "curtain",
                                "--probes", "3", "--probe-sources", "10"});
  ASSERT_EQ(baked.code, 0) << baked.err;
  EXPECT_EQ(baked.err.find("  listen "), std::string::npos) << baked.err;
  for (const char* const name :
       {"stadium", "violin", "octave-bands", "convergence", "walk", "field", "motion", "seeds"}) {
    const Outcome outcome = clamor({"experiment", name, bake, "-o", folder / "r", "--quick"});
    EXPECT_EQ(outcome.code, 1) << name;
    EXPECT_NE(outcome.err.find("it has no emitters"), std::string::npos) << outcome.err;
  }
}

TEST(Strategies, OfTheCommandLineAreCheckedBeforeAnythingIsWritten) {
  const Folder folder;
  const std::string level = baked_level(folder), wav = folder / "out.wav";
  const auto render = [&](const std::vector<std::string>& words) {
    std::vector<std::string> all = {"render",  level,       "-o",  wav,           "--listener",
                                    "0,1.7,2", "--seconds", "0.1", "--receivers", "omni"};
    all.insert(all.end(), words.begin(), words.end());
    return clamor(all);
  };
  EXPECT_EQ(render({"--strategy", "octre"}).code, 2);
  EXPECT_EQ(render({"--estimator", "energy"}).code, 2);
  EXPECT_EQ(render({"--voices", "0"}).code, 2);
  EXPECT_EQ(render({"--epsilon", "0.5"}).code, 2);
  EXPECT_EQ(read(wav), "");
  ASSERT_EQ(render({"--strategy", "octree", "--estimator", "amplitude", "--voices", "50"}).code, 0);
  const std::string octree = read(wav);
  ASSERT_EQ(render({"--strategy", "octree", "--estimator", "amplitude", "--voices", "50"}).code, 0);
  EXPECT_EQ(read(wav), octree) << "the same bytes each time";
  ASSERT_EQ(render({"--strategy", "octree", "--estimator", "amplitude", "--voices", "50",
                    "--strategy-seed", "2"})
                .code,
            0);
  EXPECT_NE(read(wav), octree);
}

TEST(Strategies, OfAnImpulseHaveTheStrengthOfAllArrivals) {
  const Folder folder;
  const std::string level = baked_level(folder);
  const auto g_db = [&](const std::vector<std::string>& words) {
    std::vector<std::string> all = {"impulse", level, "--listener", "0,1.7,2", "--json"};
    all.insert(all.end(), words.begin(), words.end());
    const Outcome outcome = clamor(all);
    EXPECT_EQ(outcome.code, 0) << outcome.err;
    return nlohmann::json::parse(outcome.out)["energy"]["g_db"][5].get<double>();
  };
  const double exact_db = g_db({});
  EXPECT_EQ(g_db({"--strategy", "all"}), exact_db);
  // The bound is 4.34 / sqrt(199) = 0.31 dB; the direct sound is exact.
  for (const std::string name : {"priority", "importance"})
    EXPECT_NEAR(g_db({"--strategy", name, "--voices", "200"}), exact_db, 0.93) << name;
  EXPECT_GT(g_db({"--strategy", "importance", "--voices", "20", "--estimator", "amplitude"}),
            exact_db + 3);
}

}  // namespace
}  // namespace clamor::testing
