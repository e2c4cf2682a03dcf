// Tests that the page of a report chooses the sources that the sampler chooses.
#include "runtime/sampling/sampler.h"
#include "tools/report/view_json.h"

#include <cstdlib>
#include <map>
#include <set>
#include <span>

#include <gmock/gmock.h>
#include <nlohmann/json.hpp>

#include "formats/bake_file/bake_metadata.h"
#include "runtime/sampling/sampling_strategy.h"
#include "tests/build_paths.h"
#include "tests/portal_rooms.h"
#include "tests/runtime/door_leaf.h"
#include "tests/tools/drawn_page.h"
#include "tests/tools/report/reported_room.h"
#include "tools/strategies/strategies.h"

namespace clamor::testing {
namespace {

// A room with directional emitters of two signals, and walls of two kinds.
Level varied_room() {
  Level level = shoebox({7, 3, 5}, uniform_material(0.15f, 0.3f, 20), {2, 1.2, 2});
  level.materials.push_back(uniform_material(0.3f, 0.1f, kMirrorExponent));
  level.mesh = box({7, 3, 5}, {0, 1, 0, 1, 0, 0});
  level.signals.push_back(sine(300));
  level.emitters.push_back(level.emitters[0]);
  level.emitters[1].position_m = {5, 1.5, 3.5};
  level.emitters[1].gain = 0.3;
  level.emitters[1].directivity = {0, 0.5, 1, 1, 2, 2, 4, 6};
  level.emitters[1].signal = 1;
  return level;
}

TEST(ReportView, ChoosesTheSourcesOfTheSampler) {
  if (!has_node()) GTEST_SKIP() << "not on this machine: node";
  const ReportedRoom reported(varied_room());
  const Room room = reported.room();
  constexpr std::size_t kHeld = 5000, kVoices = 300;
  const Vec3 place_m(3.1, 1.6, 4.2);
  const auto view = view_json(room, {}, {}, {}, {.sources = kHeld});
  ASSERT_TRUE(view.ok());
  const std::string json = reported.folder().write("view.json", view->dump());
  const std::string out = reported.folder() / "choice.json";
  const std::string command = "node '" + std::string(kSourceDir) +
                              "/tests/tools/report/page/choose.mjs' '" + json + "' 3.1,1.6,4.2 " +
                              std::to_string(kVoices) + " > '" + out + "'";
  ASSERT_EQ(std::system(command.c_str()), 0);
  const auto chosen = nlohmann::json::parse(read(out));

  // The sampler chooses among the same sources, each signal at its loudest.
  const HeldSources held = held_sources(room, kHeld);
  ASSERT_GT(held.missing_key, 0);
  std::vector<Source> sources;
  for (const std::size_t i : held.index) sources.push_back(room.sources[i]);
  const RadiationModel radiation(
      room.emitters(), room.file->materials(), room.file->settings().air,
      LateBoost(room.file->statistics().decay, room.file->source_count()));
  const SignalWeights weights{*loudest_weights(*room.file)};
  SourceList list(radiation, weights, sources);
  const auto sampler =
      make_sampler({.strategy = "priority", .voices = kVoices}, radiation, weights, list);
  std::map<std::size_t, double> expected;
  for (const SampledSource& one : sampler->sample(Listener(place_m))) {
    const double power = sum_of(one.source->power);
    expected[one.number] = std::max(one.power_scale, held.missing_key / power);
  }
  ASSERT_EQ(expected.size(), kVoices);
  ASSERT_EQ(chosen.size(), kVoices);
  for (const auto& one : chosen) {
    const auto found = expected.find(one["index"].get<std::size_t>());
    ASSERT_NE(found, expected.end()) << one;
    // Kernels in single precision, and half decibels of power.
    EXPECT_NEAR(one["scale"].get<double>(), found->second, 2e-3 * found->second);
  }
}

TEST(ReportView, HoldsTheTopOfALargeBakeAndSaysHowMuchThatIs) {
  const ReportedRoom reported(varied_room());
  const Room room = reported.room();
  const auto view = view_json(room, {}, {}, {}, {.sources = 1000, .triangles = 5, .nodes = 10});
  ASSERT_TRUE(view.ok());
  const nlohmann::ordered_json& json = *view;
  EXPECT_EQ(json["sources"]["held"], 1000);
  EXPECT_EQ(json["sources"]["total"], room.file->source_count());
  EXPECT_EQ(json["mesh"]["total"], 12);
  EXPECT_EQ(json["mesh"]["corners16"].get<std::string>().size(), 40u) << "5 triangles in base64";
  EXPECT_GE(json["nodes"]["shown"], 1);
  EXPECT_LT(json["nodes"]["shown"], json["nodes"]["depths"]);
  EXPECT_LT(view->dump().size(), 250'000u);
}

using ::testing::HasSubstr;

Level with_door() {
  Level level = portal_rooms();
  level.materials.push_back(uniform_material(0.3f));
  level.materials.back().name = "oak";
  level.materials.back().transmission = same_in_all_bands(0.001f);
  level.movable_parts = {door(0, 1)};
  level.portals[0].name = "gate";
  level.portals[0].parts = {0};
  return level;
}

TEST(ReportDoors, AreListedWithTheirPlaceSizeAndWhatTheyTransmit) {
  if (!has_node()) GTEST_SKIP() << "not on this machine: node";
  const ReportedRoom reported(with_door());
  const std::string page = reported.folder() / "page.html";
  ASSERT_EQ(clamor({"report", reported.path(), "-o", page, "--listener", "1,1.5,1"}).code, 0);
  const std::string html = drawn(page);
  EXPECT_THAT(html, HasSubstr("1 movable part and 1 portal"));
  EXPECT_THAT(html, HasSubstr("0.04 x 1.00 x 2.00"));
  EXPECT_THAT(html, HasSubstr("oak (lets -30 dB through at 1 kHz)"));
  EXPECT_THAT(html, HasSubstr("6.0, 1.0, 2.5"));
  EXPECT_THAT(html, HasSubstr("0.90 x 2.00"));
  EXPECT_THAT(html, HasSubstr("baked open, opened and closed by 'Door'"));
  EXPECT_THAT(html, HasSubstr("opens and closes 'gate'"));
}

TEST(ReportDoors, AreInTheViewAndThePlan) {
  const ReportedRoom reported(with_door());
  const auto view = view_json(reported.room(), {}, {}, {}, {});
  ASSERT_TRUE(view.ok());
  EXPECT_THAT(view->dump(), HasSubstr(R"("parts":[{"name":"Door","centre":[5.05,2.0,1.0])"));
  EXPECT_THAT(view->dump(), HasSubstr(R"("portals":[{"name":"gate")"));
}

TEST(ReportDoors, LeaveNoSectionWithoutAny) {
  if (!has_node()) GTEST_SKIP() << "not on this machine: node";
  const ReportedRoom reported(portal_rooms(false));
  const std::string page = reported.folder() / "page.html";
  ASSERT_EQ(clamor({"report", reported.path(), "-o", page, "--listener", "1,1.5,1"}).code, 0);
  EXPECT_EQ(drawn(page).find("Doors and portals"), std::string::npos);
}

}  // namespace
}  // namespace clamor::testing
