#include "bake/octree/neighbour_kernel.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <limits>
#include <span>

#include "bake/octree/nearest_neighbours.h"
#include "bake/octree/neighbour_scratch.h"

// Highway compiles the following once per instruction set.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "bake/octree/neighbour_kernel.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace clamor {
namespace HWY_NAMESPACE {
namespace {

namespace hn = hwy::HWY_NAMESPACE;

using Floats = hn::CappedTag<float, PointRuns::kFan>;
using Integers = hn::RebindToSigned<Floats>;
using Doubles = hn::CappedTag<double, PointRuns::kFan>;

struct FloatPlace {
  float x, y, z;
};

HWY_INLINE auto squared(hn::Vec<Floats> x, hn::Vec<Floats> y, hn::Vec<Floats> z) {
  return hn::Add(hn::Add(hn::Mul(x, x), hn::Mul(y, y)), hn::Mul(z, z));
}

// The exchanges that sort 16 values (K. E. Batcher, Sorting networks and their applications, AFIPS
// 1968).
struct Exchange {
  std::uint8_t low, high;
};
constexpr auto kExchanges = [] {
  std::array<Exchange, 63> all{};
  std::size_t count = 0;
  for (unsigned p = 1; p < kNeighbours; p *= 2)
    for (unsigned k = p; k >= 1; k /= 2)
      for (unsigned j = k % p; j + k < kNeighbours; j += 2 * k)
        for (unsigned i = j; i < j + k && i + k < kNeighbours; ++i)
          if (i / (2 * p) == (i + k) / (2 * p))
            all[count++] = {static_cast<std::uint8_t>(i), static_cast<std::uint8_t>(i + k)};
  return all;
}();

// Squared distances of a place from as many points as a vector has lanes, from `first`, a multiple
// of that number.
HWY_INLINE auto squared_from(const FloatPlace& place, const PointRuns& points, std::size_t first) {
  const Floats d;
  return squared(hn::Sub(hn::Set(d, place.x), hn::LoadU(d, points.position_m(0, first))),
                 hn::Sub(hn::Set(d, place.y), hn::LoadU(d, points.position_m(1, first))),
                 hn::Sub(hn::Set(d, place.z), hn::LoadU(d, points.position_m(2, first))));
}

// The lanes for which a mask holds, as bits.
template <class Mask>
HWY_INLINE std::uint64_t bits_of(Mask mask) {
  std::array<std::uint8_t, 8> bits{};
  hn::StoreMaskBits(Floats(), mask, bits.data());
  return bits[0];
}

// Calls work(i) for each set bit. (Highway's CompressStore() copies its tables at each call in
// GCC.)
template <class Work>
HWY_INLINE void for_bits(std::uint64_t bits, const Work& work) {
  for (; bits != 0; bits &= bits - 1) work(static_cast<std::size_t>(std::countr_zero(bits)));
}

// How far the ranges from low to high are from that of one box.
HWY_INLINE auto gap(const float* low, const float* high, float box_low, float box_high) {
  const Floats d;
  return hn::Max(hn::Max(hn::Sub(hn::LoadU(d, low), hn::Set(d, box_high)),
                         hn::Sub(hn::Set(d, box_low), hn::LoadU(d, high))),
                 hn::Zero(d));
}

FloatPlace place_of(const PointRuns& points, std::size_t i) {
  return {*points.position_m(0, i), *points.position_m(1, i), *points.position_m(2, i)};
}

// Upper bound of the squared distance of the farthest neighbour, from 16 consecutive points that
// begin at `from` or up to seven before.
float bound_by_order(const PointRuns& points, const FloatPlace& place, std::size_t from) {
  const Floats d;
  from -= from % PointRuns::kFan;
  auto farthest = hn::Zero(d);
  for (std::size_t i = 0; i < kNeighbours; i += hn::Lanes(d))
    farthest = hn::Max(farthest, squared_from(place, points, from + i));
  return hn::GetLane(hn::MaxOfLanes(d, farthest));
}

// Upper bound from a point whose farthest neighbour is known.
float bound_by(const FloatPlace& of, const FloatPlace& known, float known_squared) {
  const float x = of.x - known.x, y = of.y - known.y, z = of.z - known.z;
  const float reach = std::sqrt(known_squared) + std::sqrt(x * x + y * y + z * z);
  return loosened(reach * reach);
}

// Collects the runs whose boxes are within a bound of the box of a run.
void reach_runs(const PointRuns& points, std::size_t run, float bound_squared,
                NeighbourScratch& scratch) {
  const Floats d;
  const auto& own = points.levels()[0][run / PointRuns::kFan];
  const std::size_t at = run % PointRuns::kFan;
  const auto bound = hn::Set(d, bound_squared);
  scratch.runs.clear();
  for (std::size_t axis = 0; axis < 3; ++axis) {
    scratch.low[axis].clear();
    scratch.high[axis].clear();
  }
  scratch.stack.assign(1, {static_cast<std::uint32_t>(points.levels().size() - 1), 0});
  while (!scratch.stack.empty()) {
    const auto [level, element] = scratch.stack.back();
    scratch.stack.pop_back();
    const auto& boxes = points.levels()[level][element];
    for (std::size_t i = 0; i < PointRuns::kFan; i += hn::Lanes(d)) {
      const auto gap_on = [&](std::size_t axis) {
        return gap(&boxes.low[axis][i], &boxes.high[axis][i], own.low[axis][at],
                   own.high[axis][at]);
      };
      for_bits(bits_of(hn::Le(squared(gap_on(0), gap_on(1), gap_on(2)), bound)),
               [&, level = level, element = element](std::size_t lane) {
                 const auto below =
                     static_cast<std::uint32_t>(element * PointRuns::kFan + i + lane);
                 if (level > 0) return void(scratch.stack.emplace_back(level - 1, below));
                 scratch.runs.push_back(below);
                 for (std::size_t axis = 0; axis < 3; ++axis) {
                   scratch.low[axis].push_back(boxes.low[axis][i + lane]);
                   scratch.high[axis].push_back(boxes.high[axis][i + lane]);
                 }
               });
    }
  }
  for (std::size_t axis = 0; axis < 3; ++axis) {
    scratch.low[axis].resize(scratch.runs.size() + PointRuns::kFan, PointRuns::Boxes::kFar);
    scratch.high[axis].resize(scratch.runs.size() + PointRuns::kFan, -PointRuns::Boxes::kFar);
  }
  scratch.near_runs.resize(scratch.runs.size());
}

// Moves the nearest of `count` candidates to `nearest` and returns how many those are: kNeighbours,
// or more if the farthest of them are equidistant.
std::size_t select_nearest(NeighbourScratch& scratch, std::size_t count) {
  const Floats d;
  const Integers di;
  for (std::size_t i = count; i % hn::Lanes(d) != 0; ++i)
    scratch.candidates.squared[i] = PointRuns::Boxes::kFar;
  const auto limit = hn::Set(di, -static_cast<std::int32_t>(kNeighbours));
  std::size_t selected = 0;
  for (std::size_t i = 0; i < count; i += hn::Lanes(d)) {
    const auto own = hn::LoadU(d, &scratch.candidates.squared[i]);
    auto nearer = hn::Zero(di);  // minus the number of points that are nearer
    for (std::size_t k = 0; k < count; ++k) {
      const auto is_nearer = hn::Lt(hn::Set(d, scratch.candidates.squared[k]), own);
      nearer = hn::Add(nearer, hn::VecFromMask(di, hn::RebindMask(di, is_nearer)));
    }
    for_bits(bits_of(hn::RebindMask(d, hn::Gt(nearer, limit))), [&](std::size_t lane) {
      scratch.nearest.squared[selected] = scratch.candidates.squared[i + lane];
      scratch.nearest.point[selected++] = scratch.candidates.point[i + lane];
    });
  }
  return selected;
}

// Sorts equidistant points by their power, the weaker first.
void break_ties(const PointRuns& points, std::size_t count, float farthest,
                NeighbourScratch& scratch) {
  std::array<std::uint32_t, NeighbourScratch::kRoom> equal;
  std::size_t nearer = 0, ties = 0;
  for (std::size_t i = 0; i < count; ++i) {
    if (scratch.nearest.squared[i] == farthest) {
      equal[ties++] = scratch.nearest.point[i];
      continue;
    }
    scratch.nearest.squared[nearer] = scratch.nearest.squared[i];
    scratch.nearest.point[nearer++] = scratch.nearest.point[i];
  }
  const auto wanted = static_cast<std::ptrdiff_t>(kNeighbours - nearer);
  std::nth_element(
      equal.begin(), equal.begin() + wanted - 1, equal.begin() + static_cast<std::ptrdiff_t>(ties),
      [&](std::uint32_t a, std::uint32_t b) { return *points.power(a) < *points.power(b); });
  std::copy_n(equal.begin(), wanted,
              scratch.nearest.point.begin() + static_cast<std::ptrdiff_t>(nearer));
  std::fill_n(scratch.nearest.squared.begin() + static_cast<std::ptrdiff_t>(nearer), wanted,
              farthest);
}

// Reduces the candidates to the kNeighbours nearest, in `nearest`, and returns the squared distance
// of the farthest.
float reduce(const PointRuns& points, std::size_t count, NeighbourScratch& scratch) {
  const std::size_t selected = select_nearest(scratch, count);
  const float farthest =
      *std::max_element(scratch.nearest.squared.begin(),
                        scratch.nearest.squared.begin() + static_cast<std::ptrdiff_t>(selected));
  if (selected > kNeighbours) break_ties(points, selected, farthest, scratch);
  return farthest;
}

// Finds the neighbours of a place, in `nearest`, and returns the squared distance of the farthest.
float find_nearest(const PointRuns& points, const FloatPlace& place, float bound_squared,
                   NeighbourScratch& scratch) {
  const Floats d;
  std::size_t near_runs = 0;
  const auto loose = hn::Set(d, loosened(bound_squared));
  for (std::size_t i = 0; i < scratch.runs.size(); i += hn::Lanes(d)) {
    const auto distance = squared(gap(&scratch.low[0][i], &scratch.high[0][i], place.x, place.x),
                                  gap(&scratch.low[1][i], &scratch.high[1][i], place.y, place.y),
                                  gap(&scratch.low[2][i], &scratch.high[2][i], place.z, place.z));
    for_bits(bits_of(hn::Le(distance, loose)),
             [&](std::size_t lane) { scratch.near_runs[near_runs++] = scratch.runs[i + lane]; });
  }
  // Points are tested in groups of 64, as many as a word has bits.
  constexpr std::size_t kRuns = 64 / PointRuns::kRun;
  std::array<float, kRuns * PointRuns::kRun> distances;
  std::size_t count = 0;
  for (std::size_t r = 0; r < near_runs; r += kRuns) {
    const auto bound = hn::Set(d, bound_squared);
    std::uint64_t bits = 0;
    for (std::size_t k = 0; k < std::min(kRuns, near_runs - r); ++k)
      for (std::size_t i = 0; i < PointRuns::kRun; i += hn::Lanes(d)) {
        const auto distance = squared_from(
            place, points, std::size_t{scratch.near_runs[r + k]} * PointRuns::kRun + i);
        hn::StoreU(distance, d, &distances[k * PointRuns::kRun + i]);
        bits |= bits_of(hn::Le(distance, bound)) << (k * PointRuns::kRun + i);
      }
    for_bits(bits, [&](std::size_t i) {
      scratch.candidates.squared[count] = distances[i];
      scratch.candidates.point[count++] = static_cast<std::uint32_t>(
          scratch.near_runs[r + i / PointRuns::kRun] * PointRuns::kRun + i % PointRuns::kRun);
    });
    if (count > NeighbourScratch::kMost) {
      bound_squared = reduce(points, count, scratch);
      count = kNeighbours;
      std::copy_n(scratch.nearest.point.begin(), count, scratch.candidates.point.begin());
      std::copy_n(scratch.nearest.squared.begin(), count, scratch.candidates.squared.begin());
    }
  }
  return reduce(points, count, scratch);
}

// Computes the radii as NearestNeighbours::radius_m() does.
void set_radii(const PointRuns& points, std::size_t first, NeighbourScratch& scratch,
               std::span<FoundRadius, PointRuns::kRun> found) {
  const Doubles d;
  for (const auto& [low, high] : kExchanges)
    for (std::size_t q = 0; q < PointRuns::kRun; q += hn::Lanes(d)) {
      const auto a = hn::LoadU(d, &scratch.power[low][q]),
                 b = hn::LoadU(d, &scratch.power[high][q]);
      hn::StoreU(hn::Min(a, b), d, &scratch.power[low][q]);
      hn::StoreU(hn::Max(a, b), d, &scratch.power[high][q]);
    }
  for (std::size_t q = 0; q < PointRuns::kRun; q += hn::Lanes(d)) {
    auto sum = hn::Zero(d);
    for (const auto& powers : scratch.power) sum = hn::Add(sum, hn::LoadU(d, &powers[q]));
    const auto own = hn::LoadU(d, points.power(first + q));
    const auto share =
        hn::IfThenElseZero(hn::Gt(sum, hn::Zero(d)), hn::Min(hn::Set(d, 1.0), hn::Div(own, sum)));
    std::array<double, PointRuns::kFan> farthest{}, radius_m{};
    for (std::size_t i = 0; i < hn::Lanes(d); ++i)
      farthest[i] = static_cast<double>(found[q + i].farthest_squared);
    hn::StoreU(hn::Sqrt(hn::Div(hn::Mul(hn::LoadU(d, farthest.data()), share), hn::Set(d, 2.0))), d,
               radius_m.data());
    for (std::size_t i = 0; i < hn::Lanes(d); ++i)
      found[q + i].radius_m = static_cast<float>(radius_m[i]);
  }
}

void find_here(const PointRuns& points, std::size_t run, std::size_t before, float before_squared,
               NeighbourScratch& scratch, std::span<FoundRadius, PointRuns::kRun> found) {
  const std::size_t first = run * PointRuns::kRun,
                    end = std::min(first + PointRuns::kRun, points.size());
  std::array<float, PointRuns::kRun> bounds{};
  float largest = 0;
  for (std::size_t q = first; q < end; ++q) {
    const FloatPlace place = place_of(points, q);
    float& bound = bounds[q - first];
    bound = std::numeric_limits<float>::max();
    // One of them lies on the same side of a jump of the curve, wherever that is.
    for (const std::size_t from : {q + PointRuns::kFan - 1, q - std::min(q, kNeighbours / 2),
                                   q - std::min(q, kNeighbours - 1)})
      bound = std::min(bound,
                       bound_by_order(points, place, std::min(from, points.size() - kNeighbours)));
    if (before < points.size())
      bound = std::min(bound, bound_by(place, place_of(points, before), before_squared));
    largest = std::max(largest, bound);
  }
  // Points in one place have neighbours without distance, however many there are.
  if (largest > 0) reach_runs(points, run, loosened(largest), scratch);
  for (std::size_t q = first; q < end; ++q) {
    float bound = bounds[q - first];
    found[q - first].farthest_squared = 0;
    if (bound == 0) continue;
    const FloatPlace place = place_of(points, q);
    if (q > first)
      bound = std::min(
          bound, bound_by(place, place_of(points, q - 1), found[q - first - 1].farthest_squared));
    found[q - first].farthest_squared = find_nearest(points, place, bound, scratch);
    for (std::size_t k = 0; k < kNeighbours; ++k)
      scratch.power[k][q - first] = *points.power(scratch.nearest.point[k]);
  }
  set_radii(points, first, scratch, found);
}

}  // namespace
}  // namespace HWY_NAMESPACE
}  // namespace clamor
HWY_AFTER_NAMESPACE();

#if HWY_ONCE

namespace clamor {

namespace {
HWY_EXPORT(find_here);
}  // namespace

void DeleteNeighbourScratch::operator()(NeighbourScratch* scratch) const { delete scratch; }

std::unique_ptr<NeighbourScratch, DeleteNeighbourScratch> make_neighbour_scratch() {
  return std::unique_ptr<NeighbourScratch, DeleteNeighbourScratch>(new NeighbourScratch());
}

void find_radii_of_run(const PointRuns& points, std::size_t run, std::size_t before,
                       float before_squared, NeighbourScratch& scratch,
                       std::span<FoundRadius, PointRuns::kRun> found) {
  HWY_DYNAMIC_DISPATCH(find_here)(points, run, before, before_squared, scratch, found);
}

}  // namespace clamor

#endif
