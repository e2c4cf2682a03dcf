// floor_map.h: room parameters over the floor of a level, at the height of ears.
//
// The floor is that which listeners can walk on (bake/probes/floor_spots.h), on a square grid.
// Floors above each other are storeys, counted from below.
#pragma once

#include <cstddef>
#include <functional>
#include <vector>

#include "common/vec.h"
#include "tools/report/room_response.h"

namespace clamor {

struct MapCell {
  int column = 0, row = 0;  // along x and z
  int storey = 0;
  Vec3 ear_m{};
  double floor_m = 0;  // height
  RoomParameters parameters;
};

struct FloorMap {
  double step_m = 0;                // 0: there is no floor
  double low_x_m = 0, low_z_m = 0;  // of column 0 and row 0
  std::vector<MapCell> cells;
  std::size_t sources = 0;  // behind each value
};

// The steps of grids: quarters of a metre from half a metre on, and a quarter more each from 4 m
// on. The first that may leave at most `max_cells` of so many spots, which lie `spacing_m` apart.
double first_grid_step_m(std::size_t spots, double spacing_m, std::size_t max_cells);
double next_grid_step_m(double step_m);

// A grid of at most `max_cells`, without values. A level without surfaces has none.
FloorMap floor_grid(const Room& room, std::size_t max_cells);

// Fills in the values, each from so many sources. Calls `progress` with the share that is done, on
// this thread.
void measure(const RoomMeter& meter, std::size_t sources,
             const std::function<void(double)>& progress, FloorMap& map);

// Up to three places that differ: near the sound, in the middle and far from it; in sight of a
// single emitter and clear of surfaces, if there are such cells. Without a map, places around the
// emitters.
std::vector<Vec3> listening_places(const Room& room, const Excitation& excitation,
                                   const FloorMap& map);

}  // namespace clamor
