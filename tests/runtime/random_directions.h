// random_directions.h: directions that are uniformly distributed over the sphere.
#pragma once

#include <cstddef>
#include <random>
#include <vector>

#include "common/vec.h"

namespace clamor::testing {

inline std::vector<Vec3f> random_directions(std::size_t count) {
  std::mt19937 random(5);
  std::normal_distribution<double> normal;
  std::vector<Vec3f> directions;
  while (directions.size() < count)
    directions.push_back(Vec3f(normalize(Vec3(normal(random), normal(random), normal(random)))));
  return directions;
}

}  // namespace clamor::testing
