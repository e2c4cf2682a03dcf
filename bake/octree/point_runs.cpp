#include "bake/octree/point_runs.h"

#include <algorithm>
#include <cstring>
#include <utility>

#include "common/thread_team.h"

namespace clamor {

Result<PointRuns> PointRuns::make(ScratchList<PowerPoint> points, std::uint64_t memory_bytes) {
  constexpr int kHighestBit = 62;  // of a code of three times 21 bits
  PointRuns made(std::move(points));
  made.sort(0, made.count_, kHighestBit, memory_bytes);
  if (const auto done = made.make_runs(); !done.ok()) return done.error();
  return made;
}

// A range that exceeds the memory is divided by a bit of the codes, as quicksort would.
void PointRuns::sort(std::size_t first, std::size_t last, int bit, std::uint64_t memory_bytes) {
  const std::span<PowerPoint> points = points_.all().subspan(first, last - first);
  if (!points_.is_in_file() || points.size_bytes() <= memory_bytes || bit < 0) {
    team_sort(points.begin(), points.end(), [](const PowerPoint& a, const PowerPoint& b) {
      return a.morton_code != b.morton_code ? a.morton_code < b.morton_code : a.index < b.index;
    });
    return points_.release(first, points.size());
  }
  constexpr std::size_t kReleased = 65536;
  std::size_t low = first, high = last;
  const auto is_above = [&](std::size_t i) {
    return (points_.all()[i].morton_code >> bit & 1) != 0;
  };
  for (std::size_t steps = 1; low < high; ++steps) {
    if (!is_above(low))
      ++low;
    else
      std::swap(points_.all()[low], points_.all()[--high]);
    if (steps % kReleased == 0) points_.release(first, points.size());
  }
  points_.release(first, points.size());
  sort(first, low, bit - 1, memory_bytes);
  sort(low, last, bit - 1, memory_bytes);
}

// Puts the runs, which are smaller than their points, in the place of these.
Result<void> PointRuns::make_runs() {
  static_assert(sizeof(Run) <= kRun * sizeof(PowerPoint));
  const std::size_t whole_runs = runs() * kRun;
  if (auto padded = points_.resize(whole_runs); !padded.ok()) return padded;
  for (std::size_t i = count_; i < whole_runs; ++i) {
    points_.all()[i] = {};
    points_.all()[i].position_m = Vec3f(Boxes::kFar);
  }
  auto* const runs = reinterpret_cast<std::byte*>(points_.all().data());
  points_.for_blocks([&](std::span<const PowerPoint> block, std::size_t first) {
    static_assert(ScratchList<PowerPoint>::kBlock % kRun == 0);
    for (std::size_t i = 0; i < block.size(); i += kRun) {
      Run run;
      for (std::size_t k = 0; k < kRun; ++k) {
        const PowerPoint& point = block[i + k];
        for (std::size_t axis = 0; axis < 3; ++axis)
          run.position_m[axis][k] = point.position_m[static_cast<int>(axis)];
        run.power[k] = point.power;
        run.index[k] = point.index;
      }
      std::memcpy(runs + (first + i) / kRun * sizeof(Run), &run, sizeof(Run));
    }
    points_.release(first / 4 * 3, block.size() / 4 * 3);  // where runs have been written
  });
  runs_ = reinterpret_cast<const Run*>(runs);
  std::size_t boxes = 0;
  for (std::size_t count = this->runs(); count > 1 || boxes == 0; boxes += count)
    count = (count + kFan - 1) / kFan;
  if (auto room = boxes_.resize(boxes); !room.ok()) return room;
  enclose();
  release();
  return {};
}

void PointRuns::enclose() {
  std::span<Boxes> left = boxes_.all();
  const auto add_level = [&](std::size_t below) {
    levels_.push_back(left.first((below + kFan - 1) / kFan));
    left = left.subspan(levels_.back().size());
    std::fill(levels_.back().begin(), levels_.back().end(), Boxes());
    return levels_.back();
  };
  const std::span<Boxes> lowest = add_level(runs());
  constexpr std::size_t kReleased = 16384;
  for (std::size_t run = 0; run < runs(); ++run) {
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const auto& places = runs_[run].position_m[axis];
      const auto end =
          places.begin() + static_cast<std::ptrdiff_t>(std::min(kRun, count_ - run * kRun));
      const auto [low, high] = std::minmax_element(places.begin(), end);
      lowest[run / kFan].low[axis][run % kFan] = *low;
      lowest[run / kFan].high[axis][run % kFan] = *high;
    }
    if (run % kReleased == 0) release();
  }
  while (levels_.back().size() > 1) {
    const std::span<const Boxes> below = levels_.back();
    const std::span<Boxes> above = add_level(below.size());
    for (std::size_t i = 0; i < below.size(); ++i)
      for (std::size_t axis = 0; axis < 3; ++axis) {
        const auto& low = below[i].low[axis];
        const auto& high = below[i].high[axis];
        above[i / kFan].low[axis][i % kFan] = *std::min_element(low.begin(), low.end());
        above[i / kFan].high[axis][i % kFan] = *std::max_element(high.begin(), high.end());
      }
  }
}

void PointRuns::release() {
  points_.release();
  boxes_.release();
}

}  // namespace clamor
