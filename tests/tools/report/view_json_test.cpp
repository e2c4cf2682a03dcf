// Tests what the view in a report's page is given.
#include "tools/report/view_json.h"

#include <gmock/gmock.h>
#include <nlohmann/json.hpp>

#include "tests/portal_rooms.h"
#include "tests/runtime/door_leaf.h"
#include "tests/tools/drawn_page.h"
#include "tests/tools/report/reported_room.h"

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

TEST(ReportView, HoldsTheTopOfALargeBakeAndSaysHowMuchThatIs) {
  const ReportedRoom reported(varied_room());
  const Room room = reported.room();
  const auto view = view_json(room, {}, {}, {}, {.sources = 1000, .triangles = 5, .nodes = 10});
  ASSERT_TRUE(view.ok());
  const nlohmann::ordered_json& json = *view;
  EXPECT_EQ(json["sources"]["held"], 1000);
  EXPECT_EQ(json["sources"]["total"], room.file->source_count() - 2) << "without the emitters";
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
