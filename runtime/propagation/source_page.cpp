#include "runtime/propagation/source_page.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <utility>

#include "common/bounds.h"
#include "runtime/propagation/source_page_kernel.h"

namespace clamor {

namespace {

using Rows = std::array<CullBlock::Row, 3>;

void put(const Vec3f& v, Rows& rows, std::size_t at) {
  for (int axis = 0; axis < 3; ++axis) rows[static_cast<std::size_t>(axis)][at] = v[axis];
}
Vec3f get(const Rows& rows, std::size_t at) { return {rows[0][at], rows[1][at], rows[2][at]}; }

// The highest bound in any direction: x exp(-slope x) is highest at 1 / slope.
float peak_of(const CullBlock& block, std::size_t at) {
  const float slope = block.slope[at], x = slope > 1 ? 1 / slope : 1;
  return block.diffuse[at] + block.lobe[at] + block.compensation[at] * x * std::exp(-slope * x);
}

void put(const CullBlock& block, std::size_t count, CullBounds& bounds, std::size_t at) {
  constexpr float kHuge = std::numeric_limits<float>::max();
  Vec3f low(kHuge), high(-kHuge);
  float radius2 = kHuge, peak = 0;
  for (std::size_t i = 0; i < count; ++i) {
    low = glm::min(low, get(block.position_m, i));
    high = glm::max(high, get(block.position_m, i));
    radius2 = std::min(radius2, block.radius2_m2[i]);
    peak = std::max(peak, peak_of(block, i));
  }
  put(low, bounds.low_m, at);
  put(high, bounds.high_m, at);
  bounds.radius2_m2[at] = radius2;
  bounds.peak[at] = peak;
}

}  // namespace

void CullBlock::set(std::size_t at, const SourceBound& bound, const Vec3f& place_m, BandMix bands) {
  put(place_m, position_m, at);
  put(bound.normal, normal, at);
  put(bound.mirror, mirror, at);
  radius2_m2[at] = bound.radius2_m2;
  diffuse[at] = bound.diffuse;
  compensation[at] = bound.compensation;
  lobe[at] = bound.lobe;
  fall[at] = bound.fall;
  slope[at] = bound.slope;
  mix[at] = bands;
}

void CulledPage::begin(std::size_t max_count) {
  count = tested = 0;
  if (index.size() >= max_count + kCullBlock) return;
  index.resize(max_count + kCullBlock);
  upper_bound.resize(max_count + kCullBlock);
}

SourcePage::SourcePage(const RadiationModel& radiation, std::span<const Bands> weights,
                       std::vector<Source> sources, std::span<const Source> bounding)
    : sources_(std::move(sources)),
      blocks_((size() + kCullBlock - 1) / kCullBlock),
      bounds_((blocks_.size() + kCullBlock - 1) / kCullBlock) {
  if (sources_.empty()) return;
  const Boundsf bounds = bounds_of(sources_, &Source::position_m);
  middle_m_ = (Vec3(bounds.low_m) + Vec3(bounds.high_m)) / 2.0;
  extent_m_ = bounds.diagonal_m() / 2;
  for (std::size_t i = 0; i < size(); ++i) {
    const Source& source = bounding.empty() ? sources_[i] : bounding[i];
    const auto at_1m = radiation.upper_bound(source, weights[radiation.signal(source)]);
    blocks_[i / kCullBlock].set(i % kCullBlock, source_bound(radiation, source, at_1m),
                                Vec3f(Vec3(source.position_m) - middle_m_), at_1m.mix);
  }
  for (std::size_t b = 0; b < blocks_.size(); ++b)
    put(blocks_[b], std::min(kCullBlock, size() - b * kCullBlock), bounds_[b / kCullBlock],
        b % kCullBlock);
}

std::size_t SourcePage::bytes() const {
  return sizeof(SourcePage) + size() * sizeof(Source) + blocks_.size() * sizeof(CullBlock) +
         bounds_.size() * sizeof(CullBounds);
}

void SourcePage::cull(const Vec3& place, double radius_m, double threshold,
                      CulledPage& culled) const {
  const Vec3 from_m = place - middle_m_;
  // Positions and the place are rounded to 24 bits each. A listener on the source hears it from
  // wherever it is the loudest.
  const double error_m = radius_m + 1e-6 + 0x1p-22 * (length(from_m) + extent_m_);
  cull_blocks(
      bounds_, blocks_, size(),
      {Vec3f(from_m), static_cast<float>(error_m), static_cast<float>(threshold * kCullThreshold)},
      culled);
}

SourceBound SourcePage::bound(std::size_t index) const {
  const CullBlock& block = blocks_[index / kCullBlock];
  const std::size_t at = index % kCullBlock;
  const Source& source = sources_[index];
  return {source.position_m,    source.normal,     source.axis(),
          block.radius2_m2[at], block.diffuse[at], block.compensation[at],
          block.lobe[at],       block.fall[at],    block.slope[at]};
}

}  // namespace clamor
