// sofa_file.h: reads head-related impulse responses from SOFA files (AES69).
//
// Directions are unit vectors: x points ahead of the head, y to its left, z up. Receivers in the
// order right, left are exchanged, and a listener who does not look along +x is turned. libmysofa
// reads the file, and libhdf5 those that it cannot (sofa_tables.h, hdf5_file.h).
#pragma once

#include <array>
#include <cstddef>
#include <string>
#include <vector>

#include "common/result.h"
#include "common/vec.h"

namespace clamor {

struct HrirSet {
  double rate_hz = 0;
  std::size_t frames = 0;  // per response
  std::vector<Vec3f> directions;
  std::vector<float>
      samples;  // [direction][left, right][frames], with the delays of the file applied

  const float* response(std::size_t direction, std::size_t ear) const {
    return samples.data() + (2 * direction + ear) * frames;
  }
};

Result<HrirSet> read_sofa(const std::string& path);

}  // namespace clamor
