#include "bake/octree/patch_radius.h"

#include <cmath>
#include <numbers>
#include <vector>

#include <gtest/gtest.h>
#include <unistd.h>

#include "bake/octree/nearest_neighbours.h"
#include "bake/trace/trace_kernel.h"
#include "tests/peak_memory.h"
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

// Compares each source with every other.
std::vector<float> slow_radii(std::span<const Source> sources) {
  std::vector<float> radii_m;
  for (const Source& source : sources) {
    NearestNeighbours neighbours;
    for (const Source& other : sources) {
      const Vec3f to = source.position_m - other.position_m;
      neighbours.add(to.x * to.x + to.y * to.y + to.z * to.z, sum_of(other.power));
    }
    radii_m.push_back(neighbours.radius_m(sum_of(source.power)));
  }
  return radii_m;
}

TEST(PatchRadius, IsThatOfTheSlowSearchOnEveryInstructionSet_NoAsan) {
  for (auto sources : {testing::wall_sources(6000), wall(60, 0.1f), wall(5, 1), wall(4, 1),
                       wall(3, 1), testing::degenerate_sources(6000, 1, {.keys = 3, .places = 700}),
                       // So many at a place that they exceed the list of candidates.
                       testing::degenerate_sources(6000, 1, {.keys = 7, .places = 9})}) {
    const auto slow = slow_radii(sources);
    for (const std::string& target : trace_kernel_targets()) {
      force_trace_kernel_target(target);
      set_patch_radii(sources);
      for (std::size_t i = 0; i < sources.size(); ++i)
        ASSERT_EQ(sources[i].patch_radius_m, slow[i]) << target << ", " << i;
    }
  }
  force_trace_kernel_target("");
}

// The memory holds fewer points, so that they are divided before they are sorted, and radii are
// found part by part.
TEST(PatchRadius, OnDiskIsTheSameAsInMemory) {
  const std::string beside = ::testing::TempDir() + "/clamor_radii_" + std::to_string(::getpid());
  const std::vector<std::vector<Source>> lists = {
      wall(400, 0.1f),  // all neighbours are equidistant with others
      testing::wall_sources(160'000),
      testing::degenerate_sources(150'000, 1, {.keys = 3, .places = 20'000}),
      testing::degenerate_sources(20'000, 1, {.keys = 3, .places = 1}),
      wall(3, 1),
      {}};
  for (std::size_t l = 0; l < lists.size(); ++l) {
    if (testing::kSanitized && lists[l].size() > 150'000) continue;  // slow
    std::vector<Source> in_memory = lists[l];
    for (std::size_t i = 0; i < in_memory.size(); ++i)
      in_memory[i].power = same_in_all_bands(1.0f + static_cast<float>(i % 7));
    ScratchList<Source> sources(beside);
    ASSERT_TRUE(sources.append(in_memory).ok());
    set_patch_radii(in_memory);
    for (const std::uint64_t memory_bytes : {100'000u, 2'000'000u, 100'000'000u}) {
      auto radii_m = find_patch_radii(sources, memory_bytes);
      ASSERT_TRUE(radii_m.ok()) << radii_m.error().message;
      ASSERT_EQ(radii_m->size(), sources.size());
      std::size_t different = 0;
      for (std::size_t i = 0; i < sources.size(); ++i)
        different += radii_m->all()[i] != in_memory[i].patch_radius_m ? 1 : 0;
      EXPECT_EQ(different, 0u) << "list " << l;
    }
  }
}

TEST(PatchRadius, OnDiskKeepsTheMemoryLimit) {
  if (testing::kSanitized) GTEST_SKIP() << "a sanitizer keeps what is freed";
  const std::string beside = ::testing::TempDir() + "/clamor_radii_" + std::to_string(::getpid());
  constexpr std::uint64_t kMemory_bytes = 10'000'000;
  ScratchList<Source> sources(beside);
  for (std::uint32_t part = 0; part < 100; ++part)
    ASSERT_TRUE(sources.append(testing::wall_sources(10'000, part)).ok());
  const testing::PeakMemory peak;
  if (!peak.known()) GTEST_SKIP() << "this system does not tell how much memory was used at most";
  ASSERT_TRUE(find_patch_radii(sources, kMemory_bytes).ok());
  EXPECT_LE(peak.more_bytes(), 2 * kMemory_bytes);
}

}  // namespace
}  // namespace clamor
