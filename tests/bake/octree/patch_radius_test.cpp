#include "bake/octree/patch_radius.h"

#include <cmath>
#include <numbers>
#include <vector>

#include <gtest/gtest.h>
#include <unistd.h>

#include "bake/octree/patch_radius_on_disk.h"
#include "bake/trace/trace_kernel.h"
#include "tests/sanitized.h"
#include "tests/source_lists.h"

namespace clamor {
namespace {

// A wall with sources of equal power every `step` metres.
std::vector<Source> wall(int side, float step) {
  std::vector<Source> sources;
  for (int x = 0; x < side; ++x)
    for (int y = 0; y < side; ++y) {
      Source source;
      source.position_m = {static_cast<float>(x) * step, static_cast<float>(y) * step, 0};
      source.power = same_in_all_bands(1);
      sources.push_back(source);
    }
  return sources;
}

TEST(PatchRadius, OnAUniformWallIsADiscOfTheAreaPerSource) {
  auto sources = wall(41, 0.1f);
  set_patch_radii(sources);
  const Source& middle = sources[20 * 41 + 20];
  // Sixteen neighbours reach 2 to sqrt(5) steps; a disc of their number has an area of 16 square
  // steps, up to the graininess of the grid.
  const double expected_m = 0.1 / std::sqrt(2 * std::numbers::pi);
  EXPECT_NEAR(middle.patch_radius_m / expected_m, 1, 0.15);
}

TEST(PatchRadius, GrowsWithTheSourcesShareOfTheLocalPower) {
  auto sources = wall(41, 0.1f);
  sources[20 * 41 + 20].power = same_in_all_bands(5);
  set_patch_radii(sources);
  auto even = wall(41, 0.1f);
  set_patch_radii(even);
  // R^2 = d^2 5 / 20 instead of d^2 / 16.
  EXPECT_NEAR(sources[20 * 41 + 20].patch_radius_m / even[20 * 41 + 20].patch_radius_m, 2, 1e-5);
}

TEST(PatchRadius, IsFiniteForOneSourceAndForNone) {
  std::vector<Source> none;
  set_patch_radii(none);
  auto one = wall(1, 1);
  set_patch_radii(one);
  EXPECT_TRUE(std::isfinite(one[0].patch_radius_m));
  std::vector<Source> same(100, one[0]);
  set_patch_radii(same);
  EXPECT_EQ(same[50].patch_radius_m, 0);
}

// The search with trees and lists alone is slow, but simple.
TEST(PatchRadius, IsThatOfTheSlowSearchOnEveryInstructionSet_NoAsan) {
  for (const auto& sources : {testing::wall_sources(20'000), wall(60, 0.1f), wall(5, 1), wall(4, 1),
                              testing::degenerate_sources(6000, 1, {.keys = 3, .places = 700}),
                              // So many at a place that they exceed the list of candidates.
                              testing::degenerate_sources(6000, 1, {.keys = 7, .places = 9})}) {
    std::vector<PowerPoint> list;
    for (const Source& source : sources)
      list.push_back(power_point(source, static_cast<std::uint32_t>(list.size())));
    const PointRuns points(list);
    std::vector<FoundRadius> slow;
    for (std::size_t i = 0; i < points.size(); ++i) {
      NearestNeighbours neighbours;
      points.find(points.point(i).position_m, neighbours);
      slow.push_back({neighbours.farthest_squared(), neighbours.radius_m(points.power()[i])});
    }
    for (const std::string& target : trace_kernel_targets()) {
      force_trace_kernel_target(target);
      const auto found = find_patch_radii(points);
      for (std::size_t i = 0; i < points.size(); ++i) {
        ASSERT_EQ(found[i].farthest_squared, slow[i].farthest_squared) << target << ", " << i;
        ASSERT_EQ(found[i].radius_m, slow[i].radius_m) << target << ", " << i;
      }
    }
  }
  force_trace_kernel_target("");
}

// The memory holds 90 000 points, so that space is divided and many neighbours lie across borders.
TEST(PatchRadius, OnDiskIsTheSameAsInMemory) {
  const std::string beside = ::testing::TempDir() + "/clamor_radii_" + std::to_string(::getpid());
  const std::vector<std::vector<Source>> lists = {
      wall(400, 0.1f),  // all neighbours are equidistant with others
      testing::wall_sources(160'000),
      testing::degenerate_sources(150'000, 1, {.keys = 3, .places = 20'000}),
      wall(3, 1),
      {}};
  for (std::size_t l = 0; l < lists.size(); ++l) {
    if (testing::kSanitized && lists[l].size() > 180'000) continue;  // slow
    std::vector<Source> in_memory = lists[l];
    for (std::size_t i = 0; i < in_memory.size(); ++i)
      in_memory[i].power = same_in_all_bands(1.0f + static_cast<float>(i % 7));
    const std::vector<Source> sources = in_memory;
    set_patch_radii(in_memory);
    const ForEachSource for_each = [&](const auto& visit) -> Result<void> {
      for (std::size_t i = 0; i < sources.size(); i += 1000) {
        std::vector<Source> some(
            sources.begin() + static_cast<std::ptrdiff_t>(i),
            sources.begin() + static_cast<std::ptrdiff_t>(std::min(sources.size(), i + 1000)));
        if (const auto done = visit(some); !done.ok()) return done;
      }
      return {};
    };
    ScratchFile file(beside);
    const auto radii = patch_radii_on_disk(for_each, for_each, sources.size(), 0, beside, file);
    ASSERT_TRUE(radii.ok()) << radii.error().message;
    ASSERT_EQ(radii->size(), sources.size());
    std::size_t different = 0;
    for (std::size_t i = 0; i < sources.size(); ++i)
      different += (*radii)[i] != in_memory[i].patch_radius_m ? 1 : 0;
    EXPECT_EQ(different, 0u) << "list " << l;
  }
}

}  // namespace
}  // namespace clamor
