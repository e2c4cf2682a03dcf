#include "runtime/mixing/itd_table.h"

#include <algorithm>

#include "runtime/voices/mix_kernel.h"

namespace clamor {

namespace {

// The direction at a point of the square from -1 to 1.
Vec3f direction_at(float u, float v) {
  Vec3f direction(u, v, 1 - std::abs(u) - std::abs(v));
  if (direction.z < 0) {
    direction.x = std::copysign(1 - std::abs(v), u);
    direction.y = std::copysign(1 - std::abs(u), v);
  }
  return normalize(direction);
}

}  // namespace

ItdTable::ItdTable(const Hrtf& head) : itd_frames_((kCells + 1) * (kCells + 1)) {
  for (int j = 0; j <= kCells; ++j)
    for (int i = 0; i <= kCells; ++i) {
      const Vec3f from = direction_at(2 * static_cast<float>(i) / kCells - 1,
                                      2 * static_cast<float>(j) / kCells - 1);
      itd_frames_[static_cast<std::size_t>(j * (kCells + 1) + i)] =
          static_cast<float>(2 * head.delay_frames(from, 1));
    }
}

// Uses the order of operations of voice_kernel.cpp, so that both have the same bits.
float ItdTable::operator()(const Vec3f& from) const noexcept REALTIME {
  const float scale = 1 / (std::abs(from.x) + std::abs(from.y) + std::abs(from.z));
  const float a = from.x * scale, b = from.y * scale;
  const bool below = from.z < 0;
  const float u = below ? std::copysign(1 - std::abs(b), a) : a;
  const float v = below ? std::copysign(1 - std::abs(a), b) : b;
  const float x = (u + 1) * (kCells / 2.0f), y = (v + 1) * (kCells / 2.0f);
  const int i = std::clamp(static_cast<int>(x), 0, kCells - 1);
  const int j = std::clamp(static_cast<int>(y), 0, kCells - 1);
  const float s = x - static_cast<float>(i), t = y - static_cast<float>(j);
  const float* const row = &itd_frames_[static_cast<std::size_t>(j * (kCells + 1) + i)];
  const float* const next = row + kCells + 1;
  const float low = row[0] + s * (row[1] - row[0]);
  const float high = next[0] + s * (next[1] - next[0]);
  return low + t * (high - low);
}

}  // namespace clamor
