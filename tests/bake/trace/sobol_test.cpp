#include "bake/trace/sobol.h"

#include <set>
#include <utility>

#include <gtest/gtest.h>

namespace clamor {
namespace {

// Definition of a (0, m, 2)-net in base 2: every division of the unit square into 2^m equal boxes
// with powers of two as sides has one of 2^m points in each box.
TEST(Sobol, HasOnePointInEachElementaryBoxOfItsFirstPlane) {
  for (const std::uint64_t key : {1ull, 77ull})
    for (int columns = 0; columns <= 8; ++columns) {
      std::set<std::pair<int, int>> boxes;
      for (std::uint32_t i = 0; i < 256; ++i) {
        const auto p = sobol_point(key, i);
        boxes.emplace(static_cast<int>(p[0] * (1 << columns)),
                      static_cast<int>(p[1] * (1 << (8 - columns))));
      }
      EXPECT_EQ(boxes.size(), 256u) << columns << " column bits";
    }
}

TEST(Sobol, StratifiesEveryCoordinateAlone) {
  for (std::size_t d = 0; d < 4; ++d) {
    std::set<int> cells;
    for (std::uint32_t i = 0; i < 1024; ++i)
      cells.insert(static_cast<int>(sobol_point(5, i)[d] * 1024));
    EXPECT_EQ(cells.size(), 1024u) << "dimension " << d;
  }
}

TEST(Sobol, IsScrambledDifferentlyByDifferentKeys) {
  int same = 0;
  for (std::uint32_t i = 0; i < 64; ++i)
    for (std::size_t d = 0; d < 4; ++d) same += sobol_point(1, i)[d] == sobol_point(2, i)[d];
  EXPECT_EQ(same, 0);
}

}  // namespace
}  // namespace clamor
