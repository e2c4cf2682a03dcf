// itd_table.h: how much later a head's right ear hears a direction than its left, as a table. Above
// 1.4 kHz, that is: what low frequencies have more, the mixer adds.
//
// The sphere on a square: the eight faces of an octahedron, folded open, in cells of about 0.7
// degrees. Between the corners of a cell it is bilinear. Finding the triangle of a head's measured
// directions costs ten times as much; against that, KEMAR's times are within 1 us in 98.5 % of all
// directions, and within 10 us where it was measured; below that, 40 degrees under the horizon,
// where triangles are slivers, within 30 us.
//
// Immutable once made. Memory: 260 kB.
#pragma once

#include <cmath>
#include <cstddef>
#include <vector>

#include "common/vec.h"
#include "runtime/hrtf/hrtf.h"
#include "runtime/realtime/realtime.h"

namespace clamor {

class ItdTable {
 public:
  static constexpr int kCells = 256;  // along a side

  explicit ItdTable(const Hrtf& head);

  // Frames; from a unit vector in the head's axes: x ahead, y to the left, z up.
  float operator()(const Vec3f& from) const noexcept REALTIME;

  const float* table() const { return lags_.data(); }  // [kCells + 1][kCells + 1]: v, u

 private:
  std::vector<float> lags_;
};

}  // namespace clamor
