#include "bake/octree/patch_radius.h"

#include <algorithm>
#include <array>
#include <cmath>

#include <nanoflann.hpp>
#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

namespace clamor {

namespace {

constexpr std::size_t kNeighbours = 16;  // including the source itself

double broadband(const Source& source) {
  double sum = 0;
  for (const float power : source.power) sum += power;
  return sum;
}

// Adaptor of the sources for nanoflann.
struct Points {
  std::span<const Source> sources;

  std::size_t kdtree_get_point_count() const { return sources.size(); }
  float kdtree_get_pt(std::size_t index, std::size_t axis) const {
    return sources[index].position_m[static_cast<int>(axis)];
  }
  template <class Box>
  bool kdtree_get_bbox(Box&) const {
    return false;
  }
};

using Tree = nanoflann::KDTreeSingleIndexAdaptor<nanoflann::L2_Simple_Adaptor<float, Points>,
                                                 Points, 3, std::uint32_t>;

// The source indices in tree order. (nanoflann 1.5 renamed the member.)
template <class AnyTree>
const auto& in_space(const AnyTree& tree) {
  if constexpr (requires { tree.vAcc_; })
    return tree.vAcc_;
  else
    return tree.vAcc;
}

}  // namespace

void set_patch_radii(std::span<Source> secondary_sources) {
  if (secondary_sources.empty()) return;
  const Points points{secondary_sources};
  Tree tree(3, points, nanoflann::KDTreeSingleIndexAdaptorParams(10));
  tree.buildIndex();

  // Sources are visited in tree order, because neighbours then share cached nodes.
  tbb::parallel_for(
      tbb::blocked_range<std::size_t>(0, secondary_sources.size(), 1024), [&](const auto& range) {
        for (std::size_t at = range.begin(); at != range.end(); ++at) {
          const std::size_t i = in_space(tree)[at];
          std::array<std::uint32_t, kNeighbours> index{};
          std::array<float, kNeighbours> distance_squared{};
          const std::size_t found = tree.knnSearch(&secondary_sources[i].position_m[0], kNeighbours,
                                                   index.data(), distance_squared.data());
          // Powers are summed in ascending order, because the order of equidistant neighbours
          // depends on the tree.
          std::array<double, kNeighbours> power{};
          for (std::size_t k = 0; k < found; ++k) power[k] = broadband(secondary_sources[index[k]]);
          std::sort(power.begin(), power.begin() + static_cast<std::ptrdiff_t>(found));
          double sum = 0;
          for (std::size_t k = 0; k < found; ++k) sum += power[k];
          const double share = sum > 0 ? std::min(1.0, broadband(secondary_sources[i]) / sum) : 0;
          const double farthest_squared = distance_squared[found - 1];
          secondary_sources[i].patch_radius_m =
              static_cast<float>(std::sqrt(farthest_squared * share / 2));
        }
      });
}

}  // namespace clamor
