#include "bake/octree/patch_radius.h"

#include <algorithm>
#include <array>
#include <utility>
#include <vector>

#include "bake/octree/nearest_neighbours.h"
#include "bake/octree/neighbour_kernel.h"
#include "bake/octree/point_runs.h"
#include "common/bounds.h"
#include "common/morton_order.h"
#include "common/thread_team.h"

namespace clamor {

namespace {

// Sources in memory, all at once.
struct OneBlock {
  std::span<const Source> sources;

  template <class Visit>
  void for_blocks(const Visit& visit) const {
    visit(sources, std::size_t{0});
  }
};

template <class Sources>
Result<PointRuns> runs_of(Sources& sources, std::size_t count, const std::string& beside,
                          std::uint64_t memory_bytes) {
  constexpr double kSteps = (1 << 21) - 1;
  Boundsf bounds;
  sources.for_blocks([&](std::span<const Source> block, std::size_t) {
    bounds.add(bounds_of(block, &Source::position_m));
  });
  const Vec3 low_m(bounds.low_m), extent_m = Vec3(bounds.high_m) - low_m;
  const double largest_m = std::max({extent_m.x, extent_m.y, extent_m.z});
  const double steps_per_m = largest_m > 0 ? kSteps / largest_m : 0;
  ScratchList<PowerPoint> points(beside);
  if (const auto room = points.reserve(count + PointRuns::kRun); !room.ok()) return room.error();
  if (const auto room = points.resize(count); !room.ok()) return room.error();
  sources.for_blocks([&](std::span<const Source> block, std::size_t first) {
    team_for(0, block.size(), 4096, [&](std::size_t i) {
      const Vec3f& place_m = block[i].position_m;
      points.all()[first + i] = {morton_code((Vec3(place_m) - low_m) * steps_per_m), place_m,
                                 static_cast<std::uint32_t>(first + i), sum_of(block[i].power)};
    });
    points.release(first, block.size());
  });
  return PointRuns::make(std::move(points), memory_bytes);
}

// With so few points that all of them are neighbours.
void find_among_few(const PointRuns& points, std::span<float> radii_m) {
  for (std::size_t i = 0; i < points.size(); ++i) {
    NearestNeighbours neighbours;
    for (std::size_t k = 0; k < points.size(); ++k) {
      float squared = 0;
      for (std::size_t axis = 0; axis < 3; ++axis) {
        const float along_m = *points.position_m(axis, i) - *points.position_m(axis, k);
        squared += along_m * along_m;
      }
      neighbours.add(squared, *points.power(k));
    }
    radii_m[points.index(i)] = neighbours.radius_m(*points.power(i));
  }
}

void find_in_runs(const PointRuns& points, std::size_t first_run, std::size_t count,
                  std::span<float> radii_m) {
  team_for_parts(count, 64, [&](std::size_t first_of_part, std::size_t end_of_part) {
    const auto scratch = make_neighbour_scratch();
    std::array<FoundRadius, PointRuns::kRun> found;
    std::size_t before = points.size();
    for (std::size_t run = first_run + first_of_part; run < first_run + end_of_part; ++run) {
      const std::size_t first = run * PointRuns::kRun,
                        end = std::min(first + PointRuns::kRun, points.size());
      find_radii_of_run(points, run, before, found.back().farthest_squared, *scratch, found);
      for (std::size_t i = first; i < end; ++i)
        radii_m[points.index(i)] = found[i - first].radius_m;
      before = first + PointRuns::kRun - 1;
    }
  });
}

template <class Sources>
Result<ScratchList<float>> radii_of(Sources& sources, std::size_t count, const std::string& beside,
                                    std::uint64_t memory_bytes) {
  auto points = runs_of(sources, count, beside, memory_bytes / 2);
  if (!points.ok()) return points.error();
  ScratchList<float> radii_m(beside);
  if (const auto room = radii_m.resize(count); !room.ok()) return room.error();
  if (count < kNeighbours) {
    find_among_few(*points, radii_m.all());
    return radii_m;
  }
  constexpr std::uint64_t kBytesPerRun = 40'000;  // with the pages of what lies round it
  const std::size_t at_once =
      beside.empty() ? points->runs() : std::max<std::size_t>(64, memory_bytes / kBytesPerRun);
  for (std::size_t first = 0; first < points->runs(); first += at_once) {
    find_in_runs(*points, first, std::min(at_once, points->runs() - first), radii_m.all());
    points->release();
    radii_m.release();
  }
  return radii_m;
}

}  // namespace

Result<ScratchList<float>> find_patch_radii(ScratchList<Source>& secondary_sources,
                                            std::uint64_t memory_bytes) {
  if (secondary_sources.size() == 0) return ScratchList<float>();
  return radii_of(secondary_sources, secondary_sources.size(), secondary_sources.beside(),
                  memory_bytes);
}

void set_patch_radii(std::span<Source> secondary_sources) {
  if (secondary_sources.empty()) return;
  OneBlock all{secondary_sources};
  const auto radii_m = radii_of(all, secondary_sources.size(), {}, 0);
  for (std::size_t i = 0; i < secondary_sources.size(); ++i)
    secondary_sources[i].patch_radius_m = radii_m->all()[i];
}

}  // namespace clamor
