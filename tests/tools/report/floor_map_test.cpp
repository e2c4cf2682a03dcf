// Tests where a report measures.
#include "tools/report/floor_map.h"

#include <algorithm>
#include <cmath>
#include <set>

#include "tests/tools/report/reported_room.h"

namespace clamor::testing {
namespace {

TEST(FloorMap, CoversTheFloorOfABoxOnceAtTheHeightOfEars) {
  const ReportedRoom reported(shoebox({6, 3, 4}, uniform_material(0.2f), {2, 1, 1}), 50, 1000);
  const Room room = reported.room();
  const FloorMap map = floor_grid(room, 100);
  // Cells of half a metre: 24 m2 have 96.
  EXPECT_DOUBLE_EQ(map.step_m, 0.5);
  EXPECT_NEAR(static_cast<double>(map.cells.size()), 96, 8);
  std::set<std::pair<int, int>> seen;
  for (const MapCell& cell : map.cells) {
    EXPECT_TRUE(seen.insert({cell.column, cell.row}).second);
    EXPECT_EQ(cell.storey, 0);
    EXPECT_NEAR(cell.floor_m, 0, 1e-3);
    EXPECT_NEAR(cell.ear_m.y, 1.5, 1e-3);
  }
  const FloorMap coarse = floor_grid(room, 20);
  EXPECT_LE(coarse.cells.size(), 20u);
  EXPECT_GE(coarse.cells.size(), 10u);
}

// Trying steps from half a metre on took hours on 40 km.
TEST(FloorMap, BeginsCloseToTheStepThatFitsAndNeverAboveIt) {
  for (const double spacing_m : {0.1, 0.25, 0.5, 2.0, 20.0})
    for (const std::size_t across : {1, 7, 30, 200, 2000})
      for (const std::size_t max_cells : {1, 20, 240}) {
        const auto fits = [&](double step_m) {
          std::set<int> columns;
          for (std::size_t i = 0; i < across; ++i)
            columns.insert(static_cast<int>(static_cast<double>(i) * spacing_m / step_m));
          return columns.size() * columns.size() <= max_cells;
        };
        double step_m = first_grid_step_m(across * across, spacing_m, max_cells);
        if (step_m > 0.5) {
          double before_m = 0.5;
          while (next_grid_step_m(before_m) < step_m) before_m = next_grid_step_m(before_m);
          EXPECT_FALSE(fits(before_m));
        }
        int steps = 1;
        for (; !fits(step_m); ++steps) step_m = next_grid_step_m(step_m);
        EXPECT_LE(steps, 9) << across << " spots, " << spacing_m << " m apart, " << max_cells;
      }
}

TEST(FloorMap, OfMoreStoreysThanCellsShowsAsManyAsItMay) {
  Level level = shoebox({6, 20, 4}, uniform_material(0.2f), {2, 1, 1});
  for (const float y : {4.0f, 8.0f, 12.0f, 16.0f})
    add_quad(level.mesh, {Vec3f(3, y, 0), Vec3f(3, y, 4), Vec3f(6, y, 4), Vec3f(6, y, 0)});
  const ReportedRoom reported(level, 50, 1000);
  const Room room = reported.room();
  EXPECT_GE(floor_grid(room, 100).cells.size(), 5u);
  EXPECT_LE(floor_grid(room, 3).cells.size(), 4u);
}

TEST(FloorMap, KnowsAGalleryAsASecondFloor) {
  Level level = shoebox({6, 6, 4}, uniform_material(0.2f), {2, 1, 1});
  add_quad(level.mesh, {Vec3f(3, 3, 0), Vec3f(3, 3, 4), Vec3f(6, 3, 4), Vec3f(6, 3, 0)});
  const ReportedRoom reported(level, 50, 1000);
  const Room room = reported.room();
  std::size_t above = 0;
  for (const MapCell& cell : floor_grid(room, 200).cells) {
    above += cell.storey == 1;
    EXPECT_NEAR(cell.floor_m, 3 * cell.storey, 1e-2);
    if (cell.storey == 1) {
      EXPECT_GT(cell.ear_m.x, 2.9);
    }
  }
  EXPECT_GT(above, 20u);
}

TEST(FloorMap, OfALevelWithoutSurfacesIsEmptyAndListenersStandBeforeTheEmitter) {
  Level level = shoebox({6, 3, 4}, uniform_material(0.2f), {2, 1, 1});
  level.mesh = {};
  const ReportedRoom reported(level, 50, 1000);
  const Room room = reported.room();
  const FloorMap map = floor_grid(room, 100);
  EXPECT_TRUE(map.cells.empty());
  const auto places_m = listening_places(room, *excitation_of(room, ""), map);
  ASSERT_EQ(places_m.size(), 1u);
  EXPECT_NEAR(length(places_m[0] - Vec3(2, 1, 1)), 4, 1e-9);
}

TEST(FloorMap, ListenersAreNearAmidAndFar) {
  const ReportedRoom reported(shoebox({12, 4, 8}, uniform_material(0.2f), {2, 1.5, 4}), 50, 1000);
  const Room room = reported.room();
  const auto places_m = listening_places(room, *excitation_of(room, ""), floor_grid(room, 200));
  ASSERT_EQ(places_m.size(), 3u);
  std::vector<double> distances_m;
  for (const Vec3& place_m : places_m) distances_m.push_back(length(place_m - Vec3(2, 1.5, 4)));
  EXPECT_TRUE(std::is_sorted(distances_m.begin(), distances_m.end()));
  EXPECT_GT(distances_m[0], 1.4);
  EXPECT_GT(distances_m[2], 7);
  for (const Vec3& place_m : places_m) {  // a metre from all walls
    EXPECT_GT(place_m.x, 0.99);
    EXPECT_LT(place_m.x, 11.01);
  }
}

// Sound that falls as 1/r^2 from a wall-less emitter: G follows in closed form.
TEST(FloorMap, ValuesInAnAnechoicRoomFollowTheInverseSquareLaw) {
  const ReportedRoom reported(shoebox({12, 3, 8}, uniform_material(1), {2, 1.5, 4}), 50, 1000);
  const Room room = reported.room();
  const RoomMeter meter(room, *excitation_of(room, ""));
  FloorMap map = floor_grid(room, 30);
  double last = 0;
  measure(
      meter, 500, [&](double share) { last = share; }, map);
  EXPECT_EQ(last, 1);
  for (const MapCell& cell : map.cells) {
    const double r_m = length(cell.ear_m - Vec3(2, 1.5, 4));
    // Air takes 0.02 dB in 10 m at 500 Hz.
    EXPECT_NEAR(cell.parameters.g_db[3].value_or(-99), 20 * std::log10(10 / r_m), 0.1);
  }
}

}  // namespace
}  // namespace clamor::testing
