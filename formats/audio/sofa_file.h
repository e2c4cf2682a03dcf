// sofa_file.h: the head-related impulse responses of a SOFA file (AES69). libmysofa ends here.
//
// Directions are unit vectors: x ahead of the head, y to its left, z up.
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
  std::size_t frames = 0;  // of each response
  std::vector<Vec3f> directions;
  std::vector<float> samples;  // [direction][left, right][frames], delays of the file included

  const float* response(std::size_t direction, std::size_t ear) const {
    return samples.data() + (2 * direction + ear) * frames;
  }
};

// An empty path takes the KEMAR dummy head that comes with libmysofa. (B. Gardner, K. Martin. HRTF
// Measurements of a KEMAR Dummy-Hrtf Microphone. MIT Media Lab, 1994.)
Result<HrirSet> read_sofa(const std::string& path);

}  // namespace clamor
