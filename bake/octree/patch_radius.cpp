#include "bake/octree/patch_radius.h"

#include <vector>

#include "common/thread_team.h"

namespace clamor {

namespace {

// With so few points that all of them are neighbours.
void find_among_few(const PointRuns& points, std::span<FoundRadius> found) {
  for (std::size_t i = 0; i < points.size(); ++i) {
    NearestNeighbours neighbours;
    points.find(points.point(i).position_m, neighbours);
    found[i] = {neighbours.farthest_squared(), neighbours.radius_m(points.power()[i])};
  }
}

}  // namespace

std::vector<FoundRadius> find_patch_radii(const PointRuns& points) {
  std::vector<FoundRadius> found(points.runs() * PointRuns::kRun);
  if (points.size() < kNeighbours) {
    find_among_few(points, found);
    return found;
  }
  team_for_parts(points.runs(), 64, [&](std::size_t first_run, std::size_t end) {
    const auto scratch = make_neighbour_scratch();
    std::size_t before = points.size();
    for (std::size_t run = first_run; run < end; ++run) {
      const std::size_t first = run * PointRuns::kRun;
      find_radii_of_run(points, run, before,
                        before < points.size() ? found[before].farthest_squared : 0, *scratch,
                        std::span<FoundRadius, PointRuns::kRun>(&found[first], PointRuns::kRun));
      before = first + PointRuns::kRun - 1;
    }
  });
  return found;
}

void set_patch_radii(std::span<Source> secondary_sources) {
  if (secondary_sources.empty()) return;
  const PointRuns points(std::span<const Source>{secondary_sources});
  const auto found = find_patch_radii(points);
  for (std::size_t i = 0; i < points.size(); ++i)
    secondary_sources[points.index()[i]].patch_radius_m = found[i].radius_m;
}

}  // namespace clamor
