#include "runtime/occlusion/occlusion_grid.h"

#include <algorithm>
#include <cmath>

#include "runtime/propagation/tolerances.h"

namespace clamor {

namespace {

using namespace visibility;

constexpr std::size_t kMinTableSize = 1 << 10;
// Level of the cell size that suits a source's distance.
int level_at(const Source& source, const Vec3& place) {
  const double size_m = kSizePerDistance * length(place - Vec3(source.position_m));
  return std::clamp(std::ilogb(std::max(size_m, 1e-3)), kFinestLevel, kCoarsestLevel);
}

std::uint64_t key_of(const Source& source, int level) {
  const float per_m = std::ldexp(1.0f, -level);
  const auto step = [per_m](float x_m) {
    return static_cast<std::uint64_t>(static_cast<std::int64_t>(std::floor(x_m * per_m))) & 0x1ffff;
  };
  const Vec3f size = glm::abs(source.normal);
  const int axis = size.x >= size.y && size.x >= size.z ? 0 : size.y >= size.z ? 1 : 2;
  const auto faces = static_cast<std::uint64_t>(
      source.is_emitter ? 6 : 2 * axis + (source.normal[axis] < 0 ? 1 : 0));
  const auto which = static_cast<std::uint64_t>(level - kFinestLevel + 1);
  return which << 59 | faces << 55 | step(source.position_m.x) << 34 |
         step(source.position_m.y) << 17 | step(source.position_m.z);
}

}  // namespace

OcclusionGrid::OcclusionGrid() : cells_(kMinTableSize) {}

// Factor from 0 to 1 by which a cell's weights have fallen since its last estimate.
float OcclusionGrid::remaining_weight(const Cell& cell, const Source& source,
                                      const Vec3& place) const {
  const double moved_m = length(place - Vec3(cell.from_m));
  const double distance_m = length(place - Vec3(source.position_m));
  const double by_distance = 1 - moved_m / std::max(kFadePerDistance * distance_m, 0.1);
  const double by_change = 1 - (change_clock_ - static_cast<double>(cell.change_clock));
  return static_cast<float>(std::max(by_distance, 0.0) * std::max(by_change, 0.0));
}

void OcclusionGrid::invalidate_on_change(double mean_error) {
  change_clock_ += kClockPerError * std::max(0.0, mean_error - usual_error_ - kToleratedError);
  usual_error_ += kErrorLearningRate * (mean_error - usual_error_);
}

// Drops old cells before the map grows.
OcclusionGrid::Cell& OcclusionGrid::find_or_add(std::uint64_t key, std::uint32_t keyframe) {
  if (Cell* const cell = cells_.find(key)) return *cell;
  if (cells_.is_full())
    cells_.erase_if([keyframe](std::uint64_t, const Cell& cell) {
      return keyframe - cell.keyframe > kForget_keyframes;
    });
  return cells_[key];
}

// Several sizes get the estimate: the one that suits now may be too fine once the listener has
// walked away.
void OcclusionGrid::add(std::uint64_t number, const Source& source, const Vec3& place,
                        bool line_is_free, const Bands& visibility, std::uint32_t keyframe,
                        std::uint32_t valid_from) {
  const int level = level_at(source, place);
  for (int l = level; l < level + kLevels; ++l) {
    Cell& cell = find_or_add(key_of(source, l), keyframe);
    const float remaining = cell.keyframe < valid_from ? 0 : remaining_weight(cell, source, place);
    for (RunningMean& mean : cell.means) {
      const float keep = remaining * std::min(1.0f, kMaxWeight / std::max(mean.weight, kMaxWeight));
      mean.weight *= keep;
      for (float& band : mean.sum) band *= keep;
    }
    RunningMean& mean = cell.means[line_is_free ? 1 : 0];
    mean.weight += 1;
    mean.newest = number;
    for (std::size_t b = 0; b < kBandCount; ++b) mean.sum[b] += visibility[b];
    cell.from_m = Vec3f(place);
    cell.keyframe = keyframe;
    cell.change_clock = static_cast<float>(change_clock_);
  }
}

bool OcclusionGrid::mean(const Source& source, const Vec3& place, bool line_is_free, Reach reach,
                         Mean& mean) const {
  const int level = level_at(source, place);
  const int levels = reach == Reach::kAfar ? kLevels : reach == Reach::kNear ? 2 : 1;
  for (int l = level; l < level + levels; ++l) {
    const Cell* const cell = cells_.find(key_of(source, l));
    if (cell == nullptr) continue;
    const RunningMean& known = cell->means[line_is_free ? 1 : 0];
    const float remaining = remaining_weight(*cell, source, place);
    if (known.weight * remaining < kMinWeight ||
        (reach == Reach::kCell && !source.is_emitter && remaining < kFreshReflection))
      continue;
    for (std::size_t b = 0; b < kBandCount; ++b) mean.visibility[b] = known.sum[b] / known.weight;
    mean.keyframe = cell->keyframe;
    mean.number = known.newest;
    return true;
  }
  return false;
}

}  // namespace clamor
