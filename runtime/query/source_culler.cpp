#include "runtime/query/source_culler.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "runtime/query/query_constants.h"
#include "runtime/query/source_culler_kernel.h"

namespace clamor {

namespace {

void put(const Vec3f& v, std::array<CullBlock::Row, 3>& rows, std::size_t at) {
  rows[0][at] = v.x;
  rows[1][at] = v.y;
  rows[2][at] = v.z;
}
Vec3f get(const std::array<CullBlock::Row, 3>& rows, std::size_t at) {
  return {rows[0][at], rows[1][at], rows[2][at]};
}

void bound(const CullBlock& block, std::size_t count, CullBounds& bounds, std::size_t at) {
  constexpr float kHuge = std::numeric_limits<float>::max();
  Vec3f low(kHuge), high(-kHuge);
  float radius2 = kHuge, diffuse = 0, bounce = 0, slope = kHuge, lobe = 0;
  for (std::size_t i = 0; i < count; ++i) {
    low = glm::min(low, get(block.position_m, i));
    high = glm::max(high, get(block.position_m, i));
    radius2 = std::min(radius2, block.radius2_m2[i]);
    diffuse = std::max(diffuse, block.diffuse[i]);
    bounce = std::max(bounce, block.bounce[i]);
    if (block.bounce[i] > 0) slope = std::min(slope, block.slope[i]);
    lobe = std::max(lobe, block.lobe[i]);
  }
  put((low + high) / 2.0f, bounds.middle_m, at);
  put((high - low) * 0.500001f, bounds.half_m, at);
  bounds.radius2_m2[at] = radius2;
  bounds.diffuse[at] = diffuse;
  bounds.bounce[at] = bounce;
  bounds.slope[at] = slope;
  bounds.lobe[at] = lobe;
}

}  // namespace

SourceCuller::SourceCuller(std::span<const CullSource> sources)
    : count_(static_cast<std::uint32_t>(sources.size())),
      blocks_((sources.size() + kCullBlock - 1) / kCullBlock),
      bounds_((blocks_.size() + kCullBlock - 1) / kCullBlock) {
  if (sources.empty()) return;
  Vec3 low(sources[0].position_m), high(low);
  for (const CullSource& source : sources) {
    low = glm::min(low, Vec3(source.position_m));
    high = glm::max(high, Vec3(source.position_m));
  }
  middle_m_ = (low + high) / 2.0;
  extent_m_ = length(high - low) / 2;
  for (std::size_t index = 0; index < sources.size(); ++index) {
    const CullSource& source = sources[index];
    CullBlock& block = blocks_[index / kCullBlock];
    const std::size_t at = index % kCullBlock;
    put(Vec3f(Vec3(source.position_m) - middle_m_), block.position_m, at);
    put(source.normal, block.normal, at);
    put(source.mirror, block.mirror, at);
    block.radius2_m2[at] = source.radius_m * source.radius_m * (1 - 1e-6f);
    block.diffuse[at] = source.diffuse;
    block.bounce[at] = source.bounce;
    block.slope[at] = source.is_emitter ? -1 : source.slope;
    block.lobe[at] = source.lobe;
    block.fall[at] = source.fall;
    block.delay_s[at] = source.delay_s;
    block.emitter[at] = source.emitter;
    block.mix[at] = source.mix;
  }
  for (std::size_t b = 0; b < blocks_.size(); ++b)
    bound(blocks_[b], std::min(kCullBlock, sources.size() - b * kCullBlock),
          bounds_[b / kCullBlock], b % kCullBlock);
}

void SourceCuller::cull(const Vec3& place, double threshold, CullResult& result,
                        const CullMargin& margin) const {
  result.bits = {};
  result.tested = 0;
  const Vec3 from_m = place - middle_m_;
  // Positions and the place are rounded to 24 bits each. A listener on the source hears it from
  // wherever it is the loudest.
  const double error_m = margin.radius_m + 1e-6 + 0x1p-22 * (length(from_m) + extent_m_);
  // For every r, 2 r error <= (r^2 / distance + distance) error.
  cull_with(bounds_, blocks_, count_,
            {Vec3f(from_m), static_cast<float>(error_m),
             static_cast<float>(std::max(1 - error_m / margin.distance_m, 0.0)),
             static_cast<float>(error_m * margin.distance_m),
             static_cast<float>(threshold * (1 - query::kThresholdSlack))},
            result);
}

double priority_upper_bound(const CullSource& s, const Vec3& place) {
  const Vec3 to_listener = place - Vec3(s.position_m), normal(s.normal), mirror(s.mirror);
  const double r_m = length(to_listener), near_m = std::max<double>(r_m, s.radius_m);
  const double spread = 1 / (near_m * near_m);
  const auto bounce_up_to = [&](double cos_o) {
    const double x = s.slope * cos_o > 1 ? 1 / static_cast<double>(s.slope) : cos_o;
    return s.bounce * x * std::exp(-s.slope * x);
  };
  if (r_m == 0) return (s.diffuse + bounce_up_to(1) + static_cast<double>(s.lobe)) * spread;
  const double cos_a = std::min(dot(to_listener, mirror) / r_m, 1.0),
               cos_o = dot(to_listener, normal) / r_m;
  const double lobe = s.lobe * std::exp(-s.fall * (1 - cos_a));
  if (s.is_emitter) return lobe * spread;
  if (cos_o <= 0) return 0;
  const double cos_i = std::max(dot(mirror, normal), 1e-9);
  return (s.diffuse * cos_o + bounce_up_to(cos_o) + lobe * std::min(1.0, cos_o / cos_i)) * spread;
}

}  // namespace clamor
