#include "bake/octree/octree_builder.h"

#include <algorithm>
#include <cmath>
#include <set>

#include <gtest/gtest.h>

#include "common/random.h"
#include "common/thread_team.h"
#include "tests/octree_reference.h"
#include "tests/peak_memory.h"
#include "tests/sanitized.h"
#include "tests/source_lists.h"

namespace clamor {
namespace {

std::vector<Source> random_sources(std::uint32_t count) {
  std::vector<Source> sources(count);
  for (std::uint32_t i = 0; i < count; ++i) {
    const RandomBits a = philox(7, {i, 0, 0, 0}), b = philox(7, {i, 1, 0, 0});
    sources[i].position_m = {20 * unit(a[0]), 5 * unit(a[1]), 30 * unit(a[2])};
    sources[i].normal = sources[i].mirror = {0, 1, 0};
    sources[i].power = same_in_all_bands(static_cast<float>(unit_above_zero(a[3])));
    sources[i].u = static_cast<float>(unit_above_zero(b[0]));
    sources[i].delay_s = static_cast<float>(unit(b[1]));
    sources[i].emitter = i;  // identifies the source
  }
  return sources;
}

float key(const Source& source) {
  double power = 0;
  for (const float p : source.power) power += p;
  return static_cast<float>(power / source.u);
}

TEST(Octree, StoresEverySourceOnceWithTheHighestKeysOnTop) {
  const auto tree = build_octree(random_sources(20000));
  std::set<std::uint32_t> seen;
  for (const Source& source : tree.sources) seen.insert(source.emitter);
  EXPECT_EQ(tree.sources.size(), 20000u);
  EXPECT_EQ(seen.size(), 20000u);

  std::vector<char> has_parent(tree.nodes.size(), 0);
  std::uint64_t expected_first = 0;
  for (std::size_t n = 0; n < tree.nodes.size(); ++n) {
    const OctreeNode& node = tree.nodes[n];
    ASSERT_EQ(node.first_source, expected_first);
    expected_first += node.source_count;
    ASSERT_GT(node.source_count, 0u);
    ASSERT_LE(node.source_count, kLeafSources);
    const auto* first = &tree.sources[node.first_source];
    EXPECT_EQ(node.highest_key, key(*first));
    for (std::uint32_t i = 1; i < node.source_count; ++i)
      ASSERT_GE(key(first[i - 1]), key(first[i]));
    for (const auto child : node.children) {
      if (child == kNoNode) continue;
      ASSERT_GT(child, n);
      EXPECT_FALSE(has_parent[child]++);
      EXPECT_EQ(node.source_count, kNodeSources);  // only full nodes have children
      EXPECT_LE(tree.nodes[child].highest_key, key(first[node.source_count - 1]));
    }
  }
  EXPECT_EQ(std::count(has_parent.begin(), has_parent.end(), 1),
            static_cast<std::ptrdiff_t>(tree.nodes.size()) - 1);
}

TEST(Octree, NodeSummariesBoundTheirSubtrees) {
  const auto tree = build_octree(random_sources(5000));
  for (const OctreeNode& node : tree.nodes) {
    double power = 0;
    const auto include = [&](const OctreeNode& part) {
      for (std::uint32_t i = 0; i < part.source_count; ++i) {
        const Source& source = tree.sources[part.first_source + i];
        power += source.power[2];
        for (int axis = 0; axis < 3; ++axis) {
          EXPECT_GE(source.position_m[axis], node.low_m[axis]);
          EXPECT_LE(source.position_m[axis], node.high_m[axis]);
        }
        EXPECT_GE(source.delay_s, node.min_delay_s);
        EXPECT_LE(source.delay_s, node.max_delay_s);
        // All normals are +Y, so the cone is the upper half space.
        EXPECT_NEAR(node.cone_cos, 0, 1e-5);
      }
    };
    std::vector<const OctreeNode*> below = {&node};
    while (!below.empty()) {
      const OctreeNode* part = below.back();
      below.pop_back();
      include(*part);
      for (const auto child : part->children)
        if (child != kNoNode) below.push_back(&tree.nodes[child]);
    }
    EXPECT_NEAR(node.power[2] / power, 1, 1e-5);
  }
}

TEST(Octree, MergesSmallOctantsIntoOneLeaf) {
  const auto tree = build_octree(testing::wall_sources(200'000));
  const auto is_leaf = [&](std::uint32_t n) {
    return std::all_of(tree.nodes[n].children.begin(), tree.nodes[n].children.end(),
                       [](std::uint32_t child) { return child == kNoNode; });
  };
  std::size_t leaves = 0, in_leaves = 0;
  for (const OctreeNode& node : tree.nodes) {
    std::uint32_t before = kNoNode;
    for (const std::uint32_t child : node.children) {
      if (child == kNoNode) continue;
      if (is_leaf(child)) {
        ++leaves;
        in_leaves += tree.nodes[child].source_count;
        if (before != kNoNode && is_leaf(before)) {
          EXPECT_GT(tree.nodes[before].source_count + tree.nodes[child].source_count, kLeafSources);
        }
      }
      before = child;
    }
  }
  EXPECT_GT(in_leaves, 500 * leaves);  // one octant per leaf would give a third of that
}

TEST(Octree, TakesAnyNumberOfSourcesInOnePlace) {
  auto sources = random_sources(5000);
  for (Source& source : sources) source.position_m = {1, 2, 3};
  const auto tree = build_octree(std::move(sources));
  EXPECT_EQ(tree.sources.size(), 5000u);
}

TEST(Octree, EqualsABruteForceTreeOnAnyNumberOfThreads_NoAsan) {
  const std::vector<testing::DegenerateList> lists = {
      {},                                 // sources on walls
      {.keys = 7},                        // equal keys: the list order decides
      {.keys = 1, .places = 2},           // chains of equal sources at the depth limit
      {.places = 5, .emitters = 3},       // a few crowded places
      {.spread_m = 1e-6},                 // positions with few distinct floats
      {.spread_m = 1e-6, .far_m = 1000},  // most sources in one cube of minimum size
      {.keys = 100, .emitters = 200}};
  // Around the size of a node, and larger than one task.
  for (const std::uint32_t count : {1u, 2u, 511u, 512u, 513u, 1024u, 5000u, 70'000u, 200'000u})
    for (std::size_t i = 0; i < lists.size(); ++i) {
      if (count > 70'000 && (lists[i].places > 0 || lists[i].far_m > 0))
        continue;                                                  // brute force takes minutes
      if (count > 5000 && i > 0 && testing::kSanitized) continue;  // slow
      const auto sources = testing::degenerate_sources(count, count + i, lists[i]);
      const SourceOctree expected = testing::build_octree_serially(sources);
      for (const int threads : {1, 2, 8}) {
        SourceOctree tree;
        with_team(threads, [&] { tree = build_octree(sources); });
        ASSERT_TRUE(testing::same_octree(tree, expected))
            << count << " sources of list " << i << " on " << threads << " threads";
      }
    }
}

TEST(Octree, IsFastForManySourcesInOnePlace_NoAsan) {
  // The brute-force check would need 4 * 10^9 comparisons, several minutes.
  auto sources = testing::degenerate_sources(2'000'000, 1, {.places = 1});
  const auto tree = build_octree(std::move(sources));
  ASSERT_EQ(tree.nodes.size(), 1 + (2'000'000 - kLeafSources + kNodeSources - 1) / kNodeSources);
  EXPECT_TRUE(std::is_sorted(tree.sources.begin(), tree.sources.end(),
                             [](const Source& a, const Source& b) { return key(a) > key(b); }));
}

TEST(Octree, IsBuiltWithinTwiceTheMemoryOfItsSources) {
  if (testing::kSanitized) GTEST_SKIP() << "a sanitizer keeps what is freed";
  constexpr std::uint32_t kCount = 1'000'000;
  auto sources = testing::wall_sources(kCount);
  const std::uint64_t list_bytes = kCount * sizeof(Source);
  const testing::PeakMemory peak;
  if (!peak.known()) GTEST_SKIP() << "this system does not tell how much memory was used at most";
  const auto tree = build_octree(std::move(sources));
  ASSERT_EQ(tree.sources.size(), kCount);
  const double times = static_cast<double>(list_bytes + peak.more_bytes()) / list_bytes;
  EXPECT_LE(times, 1.7);
  EXPECT_GE(times, 1.4);  // list and entries; less would mean that the measurement failed
}

TEST(Octree, OfNothingIsEmpty) { EXPECT_TRUE(build_octree({}).nodes.empty()); }

}  // namespace
}  // namespace clamor
