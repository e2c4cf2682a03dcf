#include "tools/report/floor_map.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <tuple>
#include <utility>

#include "bake/probes/floor_spots.h"
#include "bake/probes/reachable_air.h"
#include "common/bounds.h"
#include "formats/bake_file/bake_metadata.h"
#include "formats/level/level.h"
#include "tools/experiments/experiment_scene.h"
#include "tools/experiments/experiments.h"

namespace clamor {

namespace {

constexpr double kClearance_m = 1, kNearest_m = 1.5;
constexpr double kSamePlace_m = 0.5;
constexpr double kNone_m = std::numeric_limits<double>::infinity();

Vec3 middle_of(const std::vector<Emitter>& emitters, const Excitation& excitation) {
  if (excitation.emitter) return emitters[*excitation.emitter].position_m;
  Vec3 sum(0);
  for (const Emitter& emitter : emitters) sum += emitter.position_m;
  return sum / static_cast<double>(emitters.size());
}

struct Spots {
  std::vector<FloorSpot> spots;
  double spacing_m = 0;
};

Spots spots_of(const Room& room) {
  Level level;
  level.mesh = room.mesh;
  level.materials = room.file->materials();
  level.emitters = room.emitters();
  const Scene scene(level.mesh, Scene::Build::kQuick);
  const ReachableAir air(scene, level, 0);
  std::vector<FloorSpot> spots = find_floor(scene, air.lattice());
  std::erase_if(spots, [](const FloorSpot& spot) { return spot.is_roof; });
  return {std::move(spots), air.lattice().cell_m()};
}

}  // namespace

double first_grid_step_m(std::size_t spots, double spacing_m, std::size_t max_cells) {
  const auto needed = static_cast<double>(spots) / static_cast<double>(max_cells);
  double step_m = 0.5;
  // A cell holds at most so many spots of a storey along each side.
  while (std::pow(std::floor(step_m / spacing_m) + 1, 2) < needed)
    step_m = next_grid_step_m(step_m);
  return step_m;
}

double next_grid_step_m(double step_m) { return step_m + (step_m < 4 ? 0.25 : step_m / 4); }

FloorMap floor_grid(const Room& room, std::size_t max_cells) {
  FloorMap map;
  if (room.mesh.triangles.empty()) return map;
  const auto [spots, spacing_m] = spots_of(room);
  if (spots.empty()) return map;
  const auto [low_m, high_m] = bounds_of(spots, &FloorSpot::ear_m);
  const double longest_m = std::max(high_m.x - low_m.x, high_m.z - low_m.z);
  // The step is the least that leaves few enough cells. Where there are more storeys than cells,
  // the first of them are shown.
  using Key = std::tuple<int, int, int>;  // storey, row, column
  std::map<Key, std::pair<double, const FloorSpot*>> best;
  for (double step_m = first_grid_step_m(spots.size(), spacing_m, max_cells);;
       step_m = next_grid_step_m(step_m)) {
    best.clear();
    map.step_m = step_m;
    map.low_x_m = low_m.x;
    map.low_z_m = low_m.z;
    int storey = 0;
    for (std::size_t i = 0; i < spots.size() && best.size() <= max_cells; ++i) {
      const FloorSpot& spot = spots[i];
      const bool above =
          i > 0 && spots[i - 1].cell[0] == spot.cell[0] && spots[i - 1].cell[2] == spot.cell[2];
      storey = above ? storey + 1 : 0;
      const int column = static_cast<int>((spot.ear_m.x - low_m.x) / step_m);
      const int row = static_cast<int>((spot.ear_m.z - low_m.z) / step_m);
      const double off_m = std::hypot(spot.ear_m.x - low_m.x - (column + 0.5) * step_m,
                                      spot.ear_m.z - low_m.z - (row + 0.5) * step_m);
      auto& [min_m, nearest] =
          best.try_emplace({storey, row, column}, kNone_m, nullptr).first->second;
      if (off_m < min_m) min_m = off_m, nearest = &spot;
    }
    if (best.size() <= max_cells || step_m > longest_m) break;
  }
  for (const auto& [key, found] : best) {
    MapCell cell;
    std::tie(cell.storey, cell.row, cell.column) = key;
    cell.ear_m = found.second->ear_m;
    cell.floor_m = found.second->floor_m;
    map.cells.push_back(cell);
  }
  return map;
}

void measure(const RoomMeter& meter, std::size_t sources,
             const std::function<void(double)>& progress, FloorMap& map) {
  map.sources = sources;
  constexpr std::size_t kBatch = 16;
  for (std::size_t first = 0; first < map.cells.size(); first += kBatch) {
    const std::size_t count = std::min(kBatch, map.cells.size() - first);
    for_each_index(count, [&](std::size_t i) {
      map.cells[first + i].parameters = meter.quick(map.cells[first + i].ear_m, sources);
    });
    progress(static_cast<double>(first + count) / static_cast<double>(map.cells.size()));
  }
}

std::vector<Vec3> listening_places(const Room& room, const Excitation& excitation,
                                   const FloorMap& map) {
  const Vec3 sound_m = middle_of(room.emitters(), excitation);
  struct Candidate {
    double distance_m;
    Vec3 place_m;
  };
  std::vector<Candidate> good, others;
  for (const MapCell& cell : map.cells) {
    const double distance_m = length(cell.ear_m - sound_m);
    if (distance_m < kNearest_m) continue;
    const bool sees =
        !excitation.emitter || room.surfaces->is_free(Vec3f(cell.ear_m), Vec3f(sound_m));
    const bool clear = is_clear(*room.surfaces, cell.ear_m, kClearance_m);
    (sees && clear ? good : others).push_back({distance_m, cell.ear_m});
  }
  if (good.empty()) good = others;
  if (good.empty()) return {sound_m + Vec3(0, 0, 4)};
  std::stable_sort(good.begin(), good.end(), [](const Candidate& a, const Candidate& b) {
    return a.distance_m < b.distance_m;
  });
  std::vector<Vec3> places_m;
  for (const double share : {0.1, 0.5, 0.95}) {
    const auto index = static_cast<std::size_t>(share * static_cast<double>(good.size()));
    const Vec3& place_m = good[std::min(index, good.size() - 1)].place_m;
    if (std::none_of(places_m.begin(), places_m.end(),
                     [&](const Vec3& other) { return length(other - place_m) < kSamePlace_m; }))
      places_m.push_back(place_m);
  }
  return places_m;
}

}  // namespace clamor
