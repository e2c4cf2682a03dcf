#include "runtime/occlusion/occlusion_grid.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "common/fibonacci_hash.h"

namespace clamor {

namespace {

constexpr std::size_t kFirstTable = 1 << 10;
constexpr std::uint32_t kForget_keyframes = 500;
constexpr double kSizePerDistance = 1.0 / 4;
constexpr int kSizes = 4, kSizesNear = 2;
// Means and looks differ by so much on any walk; twice that, and nothing is as it was.
constexpr double kExpected = 0.08, kPerSurprise = 10, kLearn = 0.3;
constexpr int kFinest = -3, kCoarsest = 5;  // 12 cm to 32 m
// Looks lose half of their weight on a tenth of the way to the source, and older ones to newer ones
// beyond so many.
constexpr double kFadePerDistance = 0.1;
constexpr float kMostWeight = 2, kEnough = 0.5f;

// Of the cell that is as large as a source's distance allows.
int level_at(const Source& source, const Vec3& place) {
  const double size_m = kSizePerDistance * length(place - Vec3(source.position_m));
  return std::clamp(std::ilogb(std::max(size_m, 1e-3)), kFinest, kCoarsest);
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
  const auto which = static_cast<std::uint64_t>(level - kFinest + 1);
  return which << 59 | faces << 55 | step(source.position_m.x) << 34 |
         step(source.position_m.y) << 17 | step(source.position_m.z);
}

}  // namespace

OcclusionGrid::OcclusionGrid() : table_(kFirstTable) {}

// How much of their weight looks have kept.
float OcclusionGrid::kept(const Cell& cell, const Source& source, const Vec3& place) const {
  const double moved_m = length(place - Vec3(cell.from_m));
  const double distance_m = length(place - Vec3(source.position_m));
  const double left = 1 - moved_m / std::max(kFadePerDistance * distance_m, 0.1);
  const double same = 1 - (surprises_ - static_cast<double>(cell.change_clock));
  return static_cast<float>(std::max(left, 0.0) * std::max(same, 0.0));
}

void OcclusionGrid::invalidate_on_change(double by) {
  surprises_ += kPerSurprise * std::max(0.0, by - expected_ - kExpected);
  expected_ += kLearn * (by - expected_);
}

const OcclusionGrid::Cell* OcclusionGrid::find(std::uint64_t key) const {
  for (std::size_t at = fibonacci_hash(key);; ++at) {
    const Cell& cell = table_[at & (table_.size() - 1)];
    if (cell.key == key) return &cell;
    if (cell.key == 0) return nullptr;
  }
}

OcclusionGrid::Cell& OcclusionGrid::find_or_add(std::uint64_t key, std::uint32_t keyframe) {
  if (const Cell* const cell = find(key)) return const_cast<Cell&>(*cell);
  if (2 * (cells_ + 1) > table_.size()) grow(keyframe);
  std::size_t at = fibonacci_hash(key);
  while (table_[at & (table_.size() - 1)].key != 0) ++at;
  ++cells_;
  Cell& cell = table_[at & (table_.size() - 1)];
  cell.key = key;
  return cell;
}

// Forgets what is old; doubles where that is not enough.
void OcclusionGrid::grow(std::uint32_t keyframe) {
  std::vector<Cell> old = std::exchange(table_, {});
  std::erase_if(old, [keyframe](const Cell& cell) {
    return cell.key == 0 || keyframe - cell.keyframe > kForget_keyframes;
  });
  std::size_t size = kFirstTable;
  while (size < 4 * old.size()) size *= 2;
  table_.assign(size, Cell{});
  cells_ = old.size();
  for (const Cell& cell : old) {
    std::size_t at = fibonacci_hash(cell.key);
    while (table_[at & (size - 1)].key != 0) ++at;
    table_[at & (size - 1)] = cell;
  }
}

// In several sizes: one that is right now may be too fine when the listener walks away.
void OcclusionGrid::add(const Source& source, const Vec3& place, bool straight,
                        const Bands& visibility, std::uint32_t keyframe) {
  const int level = level_at(source, place);
  for (int l = level; l < level + kSizes; ++l) {
    Cell& cell = find_or_add(key_of(source, l), keyframe);
    const float left = kept(cell, source, place);
    for (Kind& kind : cell.kinds) {
      const float keep = left * std::min(1.0f, kMostWeight / std::max(kind.weight, kMostWeight));
      kind.weight *= keep;
      for (float& band : kind.sum) band *= keep;
    }
    Kind& kind = cell.kinds[straight ? 1 : 0];
    kind.weight += 1;
    for (std::size_t b = 0; b < kBandCount; ++b) kind.sum[b] += visibility[b];
    cell.from_m = Vec3f(place);
    cell.keyframe = keyframe;
    cell.change_clock = static_cast<float>(surprises_);
  }
}

bool OcclusionGrid::is_of(std::uint32_t keyframe, const Source& source, const Vec3& place) const {
  const Cell* const cell = find(key_of(source, level_at(source, place)));
  return cell != nullptr && cell->keyframe == keyframe;
}

bool OcclusionGrid::mean(const Source& source, const Vec3& place, bool straight, bool from_afar,
                         Mean& mean) const {
  const int level = level_at(source, place);
  for (int l = level; l < level + (from_afar ? kSizes : kSizesNear); ++l) {
    const Cell* const cell = find(key_of(source, l));
    if (cell == nullptr) continue;
    const Kind& kind = cell->kinds[straight ? 1 : 0];
    if (kind.weight * kept(*cell, source, place) < kEnough) continue;
    for (std::size_t b = 0; b < kBandCount; ++b) mean.visibility[b] = kind.sum[b] / kind.weight;
    mean.keyframe = cell->keyframe;
    return true;
  }
  return false;
}

}  // namespace clamor
