// instances_test.cpp: the program on a level with repeated groups.
#include <cmath>
#include <cstring>

#include <nlohmann/json.hpp>

#include "tests/formats/level_builder.h"
#include "tests/tools/run_clamor.h"

namespace clamor {
namespace {

using testing::clamor;
using testing::Folder;
using testing::json;
using testing::read;

// Two stands of four blocks of thirty fans above a ground of 60 x 60 m; block 5 can be made to
// differ.
std::string level_in(const Folder& folder, double moved_m = 0) {
  folder.write("song.wav", testing::wav());
  folder.write("shout.wav", testing::wav(12000));
  json level = {{"asset", {{"version", "2.0"}}}, {"scene", 0}};
  level["extensions"]["KHR_audio_emitter"] = {
      {"audio", {{{"uri", "song.wav"}}, {{"uri", "shout.wav"}}}},
      {"sources", {{{"audio", 0}, {"loop", true}}, {{"audio", 1}, {"loop", true}}}},
      {"emitters",
       {{{"type", "positional"}, {"sources", {0}}}, {{"type", "positional"}, {"sources", {1}}}}}};
  const std::vector<float> ground = {-30, 0, -30, 30, 0, -30, 30, 0, 30, -30, 0, 30};
  const std::vector<std::uint16_t> corners = {0, 2, 1, 0, 3, 2};
  const std::string bin = testing::raw(ground) + testing::raw(corners);
  level["buffers"] = {{{"byteLength", bin.size()},
                       {"uri", "data:application/octet-stream;base64," + testing::base64(bin)}}};
  level["bufferViews"] = {{{"buffer", 0}, {"byteOffset", 0}, {"byteLength", 48}},
                          {{"buffer", 0}, {"byteOffset", 48}, {"byteLength", 12}}};
  level["accessors"] = {
      {{"bufferView", 0}, {"componentType", 5126}, {"count", 4}, {"type", "VEC3"}},
      {{"bufferView", 1}, {"componentType", 5123}, {"count", 6}, {"type", "SCALAR"}}};
  level["meshes"] = {{{"primitives", {{{"attributes", {{"POSITION", 0}}}, {"indices", 1}}}}}};
  json nodes = json::array();
  const auto add = [&](json node) {
    nodes.push_back(std::move(node));
    return static_cast<int>(nodes.size()) - 1;
  };
  std::vector<int> stands = {add({{"name", "ground"}, {"mesh", 0}})};
  for (int stand = 0; stand < 2; ++stand) {
    std::vector<int> blocks;
    for (int block = 0; block < 4; ++block) {
      std::vector<int> fans;
      for (int fan = 0; fan < 30; ++fan) {
        const bool moved = 4 * stand + block == 5 && fan == 7;
        const json place = {0.7 * (fan % 6), 1 + 0.4 * (fan / 6),
                            0.8 * (fan / 6) + 0.05 * (fan % 4) + (moved ? moved_m : 0)};
        const std::string name =
            "fan " + std::to_string(4 * stand + block) + "." + std::to_string(fan);
        fans.push_back(
            add({{"name", name},
                 {"translation", place},
                 {"extensions",
                  {{"KHR_audio_emitter", {{"emitters", {(fan + block) % 2}}}},
                   {"CLAMOR_emitter", {{"delay_s", 0.01 * (fan % 5) + 0.1 * block}}}}}}));
      }
      blocks.push_back(
          add({{"name", "block"}, {"translation", {5.0 * block, 0, 0}}, {"children", fans}}));
    }
    const json turn = {0, stand, 0, 1 - stand};  // half a turn, or none
    stands.push_back(add({{"name", "stand"},
                          {"translation", {stand == 0 ? -9 : 9, 0, stand == 0 ? 12 : -12}},
                          {"rotation", turn},
                          {"children", blocks}}));
  }
  level["nodes"] = nodes;
  level["scenes"] = {{{"nodes", stands}}};
  return folder.write("terraces.gltf", level.dump());
}

testing::Outcome bake(const std::string& level, const std::string& output,
                      const std::vector<std::string>& more = {}) {
  std::vector<std::string> words = {"bake",      level,  "-o",        output,
                                    "--photons", "9600", "--sources", "4000"};
  words.insert(words.end(), more.begin(), more.end());
  const auto outcome = clamor(words);
  EXPECT_EQ(outcome.code, 0) << outcome.err;
  return outcome;
}

json inspected(const std::string& file) {
  const auto outcome = clamor({"inspect", file, "--verify", "--json"});
  EXPECT_EQ(outcome.code, 0) << outcome.err;
  return json::parse(outcome.out);
}

TEST(InstancesCommand, BakeSaysWhatInstancesShareAndInspectShowsIt_NoAsan) {
  const Folder folder;
  const std::string level = level_in(folder);
  const auto told = bake(level, folder / "a.clamor");
  EXPECT_NE(told.err.find("10 emitter groups have the sources of 2 prototypes:"), std::string::npos)
      << told.err;
  const json a = inspected(folder / "a.clamor");
  EXPECT_EQ(a["sources"]["emitters"], 240);
  EXPECT_EQ(a["sources"]["total"].get<int>(), 240 + a["sources"]["secondary"].get<int>());
  EXPECT_LT(a["sources"]["stored"], a["sources"]["total"]);
  EXPECT_GT(a["instanced"]["trees"], 0);
  EXPECT_EQ(a["emitters"].size(), 240u);

  const auto off = bake(level, folder / "b.clamor", {"--instances", "off"});
  EXPECT_EQ(off.err.find("emitter groups"), std::string::npos) << off.err;
  const json b = inspected(folder / "b.clamor");
  EXPECT_EQ(b["instanced"]["trees"], 0);
  EXPECT_EQ(b["sources"]["total"], a["sources"]["total"]);
  EXPECT_LT(a["bytes"]["root"].get<int>(), b["bytes"]["root"].get<int>() / 2);
  EXPECT_NE(b["provenance"]["command"].get<std::string>().find("--instances off"),
            std::string::npos);
  EXPECT_EQ(clamor({"bake", level, "-o", folder / "c.clamor", "--instances", "some"}).code, 2);
  // Names and everything else are as in the level.
  for (std::size_t e = 0; e < 240; ++e) {
    EXPECT_EQ(a["emitters"][e]["name"], b["emitters"][e]["name"]);
    EXPECT_EQ(a["emitters"][e]["signal"], b["emitters"][e]["signal"]);
  }
  const json diff =
      json::parse(clamor({"diff", folder / "a.clamor", folder / "b.clamor", "--json"}).out);
  for (const double level_difference_db : diff["level_db"])
    EXPECT_NEAR(level_difference_db, 0, 1e-4);
}

// Returns the samples of a float WAV file.
std::vector<float> samples_of(const std::string& path) {
  const std::string bytes = read(path);
  const std::size_t data = bytes.find("data");
  EXPECT_NE(data, std::string::npos);
  std::vector<float> samples((bytes.size() - data - 8) / sizeof(float));
  std::memcpy(samples.data(), bytes.data() + data + 8, samples.size() * sizeof(float));
  return samples;
}

TEST(InstancesCommand, RenderOfAllSourcesIsTheSameSound_NoAsan) {
  const Folder folder;
  const std::string level = level_in(folder);
  std::vector<std::vector<float>> heard;
  for (const std::string instances : {"on", "off"}) {
    const std::string file = folder / (instances + ".clamor"), wav = folder / (instances + ".wav");
    bake(level, file, {"--instances", instances});
    const auto outcome = clamor({"render", file, "--receivers", "omni", "-o", wav, "--listener",
                                 "1,1.6,2", "--seconds", "0.5", "--strategy", "all"});
    ASSERT_EQ(outcome.code, 0) << outcome.err;
    heard.push_back(samples_of(wav));
  }
  ASSERT_EQ(heard[0].size(), heard[1].size());
  double sum = 0, difference = 0;
  for (std::size_t i = 0; i < heard[0].size(); ++i) {
    const double a = static_cast<double>(heard[0][i]), b = static_cast<double>(heard[1][i]);
    sum += b * b;
    difference += (a - b) * (a - b);
  }
  ASSERT_GT(sum, 0);
  // Rotations are stored as floats, which moves fans by a few micrometres: -80 dB at 1 kHz, where
  // these songs are.
  EXPECT_LT(10 * std::log10(difference / sum), -80);
}

TEST(InstancesCommand, ShardsMergeAndThreadsBakeToTheSameBytes_NoAsan) {
  const Folder folder;
  const std::string level = level_in(folder);
  bake(level, folder / "whole.clamor", {"--threads", "1", "--no-journal"});
  bake(level, folder / "threads.clamor", {"--threads", "3", "--no-journal"});
  EXPECT_TRUE(read(folder / "whole.clamor") == read(folder / "threads.clamor"));
  bake(level, folder / "1.shard", {"--shard", "1/2"});
  bake(level, folder / "2.shard", {"--shard", "2/2"});
  const auto merged =
      clamor({"merge", folder / "2.shard", folder / "1.shard", "-o", folder / "merged.clamor"});
  ASSERT_EQ(merged.code, 0) << merged.err;
  EXPECT_TRUE(read(folder / "whole.clamor") == read(folder / "merged.clamor"));
}

TEST(InstancesCommand, BakeOfALevelInWhichOneFanMovedTracesOnlyThatFan_NoAsan) {
  const Folder folder;
  bake(level_in(folder), folder / "a.clamor", {"--keep-journal"});
  const auto again = bake(level_in(folder, 0.02), folder / "a.clamor");
  EXPECT_NE(again.err.find("7 emitter groups have the sources of 1 prototype:"), std::string::npos)
      << again.err;
  EXPECT_NE(again.err.find("  reused   9560 of 9600 photons"), std::string::npos) << again.err;
  bake(level_in(folder, 0.02), folder / "fresh.clamor", {"--no-journal"});
  EXPECT_TRUE(read(folder / "a.clamor") == read(folder / "fresh.clamor"));
}

TEST(InstancesCommand, ImpulseOfOneInstancedFanIsThatOfTheFanAlone_NoAsan) {
  const Folder folder;
  const std::string level = level_in(folder);
  std::vector<json> g_db;
  for (const std::string instances : {"on", "off"}) {
    bake(level, folder / "a.clamor", {"--instances", instances, "--no-journal"});
    const auto outcome = clamor({"impulse", folder / "a.clamor", "-o", folder / "ir.wav",
                                 "--listener", "1,1.6,2", "--from", "fan 6.11", "--json"});
    ASSERT_EQ(outcome.code, 0) << outcome.err;
    g_db.push_back(json::parse(outcome.out)["energy"]["g_db"]);
  }
  for (std::size_t b = 0; b < 8; ++b)
    EXPECT_NEAR(g_db[0][b].get<double>(), g_db[1][b].get<double>(), 0.01);
}

}  // namespace
}  // namespace clamor
