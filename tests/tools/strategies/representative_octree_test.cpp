// representative_octree_test.cpp: the tree of representatives and its cuts (section 3.5 of the
// paper).
#include "tools/strategies/representative_octree.h"

#include <algorithm>
#include <cmath>
#include <map>

#include <gtest/gtest.h>

#include "common/random.h"

namespace clamor {

// A cut by its definition: search all nodes, open the most important one, repeat.
class SlowCut {
 public:
  static std::map<std::uint32_t, double> cut(const RepresentativeOctree& tree, const Vec3& place,
                                             std::size_t k) {
    std::vector<std::uint32_t> cut = {0};
    for (;;) {
      std::size_t best = cut.size();
      double highest = -1;
      for (std::size_t i = 0; i < cut.size(); ++i) {
        const auto& node = tree.nodes_[cut[i]];
        const double importance = tree.importance(node, place, Reception());
        if (node.children == 0) continue;
        if (importance > highest || (importance == highest && cut[i] < cut[best])) {
          best = i;
          highest = importance;
        }
      }
      if (best == cut.size()) break;
      const auto node = tree.nodes_[cut[best]];
      if (cut.size() - 1 + node.children > k) break;
      cut.erase(cut.begin() + static_cast<std::ptrdiff_t>(best));
      for (std::uint32_t c = 0; c < node.children; ++c) cut.push_back(node.first_child + c);
    }
    std::map<std::uint32_t, double> sample;
    for (const std::uint32_t index : cut) {
      const auto& node = tree.nodes_[index];
      sample[node.point] = node.volume / tree.volumes_[node.point];
    }
    return sample;
  }
};

namespace {

std::vector<RepresentativeOctree::Point> cloud(std::uint32_t count) {
  std::vector<RepresentativeOctree::Point> points;
  for (std::uint32_t i = 0; i < count; ++i) {
    const RandomBits bits = philox(3, {i, 0, 0, 0});
    points.push_back({Vec3(30 * unit(bits[0]), 5 * unit(bits[1]), 40 * unit(bits[2])),
                      0.1 + unit(bits[3]), 0.1});
  }
  return points;
}

TEST(RepresentativeOctree, IsCutLikeTheReference) {
  const auto points = cloud(3000);
  const RepresentativeOctree tree(points, 2, 1);
  for (const std::size_t k : {1u, 7u, 8u, 100u, 500u})
    for (const Vec3& place : {Vec3(15, 2, 20), Vec3(-5, 1, 3), Vec3(29, 4, 39)}) {
      std::map<std::uint32_t, double> sample;
      for (const auto& [point, factor] : tree.cut(place, k)) sample[point] = factor;
      const auto slow = SlowCut::cut(tree, place, k);
      ASSERT_EQ(sample.size(), slow.size());
      for (const auto& [point, factor] : slow) {
        ASSERT_TRUE(sample.contains(point));
        EXPECT_NEAR(sample[point] / factor, 1, 1e-12);
      }
      EXPECT_LE(sample.size(), k);
      EXPECT_GE(sample.size() + 6, k);
    }
}

TEST(RepresentativeOctree, TakesEverythingUnscaledWhenThereIsRoom) {
  const auto points = cloud(200);
  const RepresentativeOctree tree(points, 2, 1);
  const auto cut = tree.cut({0, 0, 0}, 200);
  ASSERT_EQ(cut.size(), 200u);
  for (std::uint32_t i = 0; i < 200; ++i) {
    EXPECT_EQ(cut[i].point, i);
    EXPECT_EQ(cut[i].factor, 1);
  }
}

TEST(RepresentativeOctree, AcceptsManySourcesAtOnePlace) {
  std::vector<RepresentativeOctree::Point> points(100, {Vec3(1, 2, 3), 1, 0.1});
  points.push_back({Vec3(2, 2, 3), 1, 0.1});
  const RepresentativeOctree tree(points, 2, 1);
  EXPECT_EQ(tree.cut({0, 0, 0}, 101).size(), 101u);
  EXPECT_GE(tree.cut({0, 0, 0}, 50).size(), 44u);
}

TEST(RepresentativeOctree, IsEmptyWithoutSources) {
  EXPECT_TRUE(RepresentativeOctree({}, 2, 1).cut({0, 0, 0}, 10).empty());
  const std::vector<RepresentativeOctree::Point> mute(3);
  EXPECT_TRUE(RepresentativeOctree(mute, 2, 1).cut({0, 0, 0}, 10).empty());
}

// Representatives are drawn child by child, and each source represents the root in proportion to
// its volume.
TEST(RepresentativeOctree, DrawsRepresentativesInProportionToTheirVolume) {
  const auto points = cloud(30);
  double volume = 0;
  for (const auto& point : points) volume += point.volume;
  std::vector<double> count(points.size());
  constexpr int kTrees = 20000;
  for (std::uint64_t seed = 0; seed < kTrees; ++seed) {
    const auto cut = RepresentativeOctree(points, 2, seed).cut({0, 0, 0}, 1);
    ASSERT_EQ(cut.size(), 1u);
    ASSERT_NEAR(cut[0].factor, volume / points[cut[0].point].volume, 1e-9);
    ++count[cut[0].point];
  }
  double chi2 = 0;
  for (std::size_t i = 0; i < points.size(); ++i) {
    const double expected = kTrees * points[i].volume / volume;
    chi2 += (count[i] - expected) * (count[i] - expected) / expected;
  }
  // There are 29 degrees of freedom: beyond 58.3 one time in 1000.
  EXPECT_LT(chi2, 58.3);
}

// The sums are unrelated to the weights that built the tree.
TEST(RepresentativeOctree, IsUnbiasedForAnySum) {
  const auto points = cloud(300);
  const auto value = [&](std::uint32_t i) {
    return points[i].volume * (1 + points[i].position_m.x) / (1 + points[i].position_m.z);
  };
  double whole = 0;
  for (std::uint32_t i = 0; i < points.size(); ++i) whole += value(i);
  constexpr int kTrees = 4000;
  double sum = 0, squares = 0;
  for (std::uint64_t seed = 0; seed < kTrees; ++seed) {
    double estimate = 0;
    for (const auto& [point, factor] : RepresentativeOctree(points, 2, seed).cut({12, 2, 3}, 40))
      estimate += factor * value(point) / whole;
    sum += estimate;
    squares += estimate * estimate;
  }
  const double mean = sum / kTrees, deviation = std::sqrt(squares / kTrees - mean * mean);
  EXPECT_GT(deviation, 0.01) << "the estimates must vary";
  EXPECT_NEAR(mean, 1, 3 * deviation / std::sqrt(kTrees));
}

}  // namespace
}  // namespace clamor
