#include "runtime/query/source_culler.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "runtime/query/source_culler_kernel.h"

namespace clamor {

namespace {

// Sources of highest keys that are sorted by direction among themselves: in most places the first
// of these are all that is looked at.
constexpr std::array<std::size_t, 3> kTiers = {32, 128, kCullerSources};
constexpr int kCellBits = 4;

// Where a direction is along a curve on the sphere that keeps neighbours together: an octahedron
// unfolded to a square, and Hilbert's curve on its 16 x 16 cells. (D. Hilbert. Ueber die stetige
// Abbildung einer Linie auf ein Flaechenstueck. Math. Annalen 38, 1891.)
std::uint32_t along_curve(const Vec3f& direction) {
  const Vec3f n =
      direction / (std::abs(direction.x) + std::abs(direction.y) + std::abs(direction.z) + 1e-20f);
  const float folded_x = (1 - std::abs(n.z)) * std::copysign(1.0f, n.x);
  const float folded_z = (1 - std::abs(n.x)) * std::copysign(1.0f, n.z);
  constexpr float kCells = 1 << kCellBits;
  const auto cell = [](float v) {
    return static_cast<std::uint32_t>(std::clamp((v + 1) * (kCells / 2), 0.0f, kCells - 1));
  };
  std::uint32_t x = cell(n.y >= 0 ? n.x : folded_x), y = cell(n.y >= 0 ? n.z : folded_z);
  std::uint32_t place = 0;
  for (std::uint32_t side = 1u << (kCellBits - 1); side > 0; side /= 2) {
    const std::uint32_t right = (x & side) != 0, up = (y & side) != 0;
    place += side * side * ((3 * right) ^ up);
    if (up == 0) {
      if (right != 0) {
        x = ~x & (2 * side - 1);
        y = ~y & (2 * side - 1);
      }
      std::swap(x, y);
    }
  }
  return place;
}

// The order in which they go into blocks.
std::array<std::uint16_t, kCullerSources> order_of(std::span<const CullSource> sources) {
  std::array<std::uint16_t, kCullerSources> order;
  std::size_t first = 0;
  for (const std::size_t tier : kTiers) {
    const std::size_t last = std::min(tier, sources.size());
    std::array<std::uint16_t, (1 << 2 * kCellBits) + 1> starts{};
    std::array<std::uint8_t, kCullerSources> cells;
    for (std::size_t i = first; i < last; ++i) {
      cells[i] = static_cast<std::uint8_t>(along_curve(sources[i].mirror));
      ++starts[cells[i] + 1u];
    }
    for (std::size_t c = 1; c < starts.size(); ++c)
      starts[c] = static_cast<std::uint16_t>(starts[c] + starts[c - 1]);
    for (std::size_t i = first; i < last; ++i)
      order[first + starts[cells[i]]++] = static_cast<std::uint16_t>(i);
    first = last;
  }
  return order;
}

// The narrowest cone round the middle of some directions.
struct Cone {
  Vec3f axis{0, 0, 1};
  float cos = -1, sin = 0;
};
template <class Direction>
Cone cone_of(std::size_t count, const Direction& direction) {
  Vec3f sum(0);
  for (std::size_t i = 0; i < count; ++i) sum += direction(i);
  const float size = glm::length(sum);
  if (!(size > 1e-3f)) return {};
  Cone cone{sum / size, 1, 0};
  for (std::size_t i = 0; i < count; ++i)
    cone.cos = std::min(cone.cos, glm::dot(cone.axis, direction(i)));
  cone.cos = std::max(cone.cos - 1e-6f, -1.0f);
  cone.sin = std::sqrt(std::max(0.0f, 1 - cone.cos * cone.cos));
  return cone;
}

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
  float radius2 = kHuge, diffuse = 0, bounce = 0, slope = kHuge, lobe = 0, fall = kHuge;
  bool all_round = false;
  for (std::size_t i = 0; i < count; ++i) {
    low = glm::min(low, get(block.position_m, i));
    high = glm::max(high, get(block.position_m, i));
    radius2 = std::min(radius2, block.radius2_m2[i]);
    diffuse = std::max(diffuse, block.diffuse[i]);
    bounce = std::max(bounce, block.bounce[i]);
    if (block.bounce[i] > 0) slope = std::min(slope, block.slope[i]);
    lobe = std::max(lobe, block.lobe[i]);
    fall = std::min(fall, block.fall[i]);
    all_round = all_round || block.slope[i] < 0;
  }
  put((low + high) / 2.0f, bounds.middle_m, at);
  put((high - low) * 0.500001f, bounds.half_m, at);
  bounds.radius2_m2[at] = radius2;
  bounds.diffuse[at] = diffuse;
  bounds.bounce[at] = bounce;
  bounds.slope[at] = slope;
  bounds.lobe[at] = lobe;
  bounds.fall[at] = fall;
  const Cone mirror = cone_of(count, [&](std::size_t i) { return get(block.mirror, i); });
  Cone normal;
  if (!all_round) normal = cone_of(count, [&](std::size_t i) { return get(block.normal, i); });
  put(mirror.axis, bounds.mirror, at);
  bounds.mirror_cos[at] = mirror.cos;
  bounds.mirror_sin[at] = mirror.sin;
  put(normal.axis, bounds.normal, at);
  bounds.normal_cos[at] = normal.cos;
  bounds.normal_sin[at] = normal.sin;
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
  const auto order = order_of(sources);
  for (std::size_t slot = 0; slot < sources.size(); ++slot) {
    const CullSource& source = sources[order[slot]];
    CullBlock& block = blocks_[slot / kCullBlock];
    const std::size_t at = slot % kCullBlock;
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
    block.index[at] = order[slot];
    block.emitter[at] = source.emitter;
    block.mix[at] = source.mix;
  }
  for (std::size_t b = 0; b < blocks_.size(); ++b)
    bound(blocks_[b], std::min(kCullBlock, sources.size() - b * kCullBlock),
          bounds_[b / kCullBlock], b % kCullBlock);
}

void SourceCuller::sift(const Vec3& place, double threshold, CullResult& sifted,
                        const CullMargin& give) const {
  sifted.bits = {};
  sifted.looked_at = 0;
  const Vec3 from_m = place - middle_m_;
  // Of positions and of the place, each rounded to 24 bits; and one that is on the source sees it
  // from wherever it is loudest.
  const double give_m = give.place_m + 1e-6 + 0x1p-22 * (length(from_m) + extent_m_);
  // Because 2 r give <= (r^2 / about + about) give.
  cull_with(bounds_, blocks_, count_,
            {Vec3f(from_m), static_cast<float>(give_m),
             static_cast<float>(std::max(1 - give_m / give.about_m, 0.0)),
             static_cast<float>(give_m * give.about_m), static_cast<float>(threshold * (1 - 1e-6))},
            sifted);
}

double priority_upper_bound(const CullSource& s, const Vec3& place) {
  const Vec3 way_m = place - Vec3(s.position_m), normal(s.normal), mirror(s.mirror);
  const double r_m = length(way_m), near_m = std::max<double>(r_m, s.radius_m);
  const double spread = 1 / (near_m * near_m);
  const auto bounce_up_to = [&](double cos_o) {
    const double x = s.slope * cos_o > 1 ? 1 / static_cast<double>(s.slope) : cos_o;
    return s.bounce * x * std::exp(-s.slope * x);
  };
  if (r_m == 0) return (s.diffuse + bounce_up_to(1) + static_cast<double>(s.lobe)) * spread;
  const double cos_a = std::min(dot(way_m, mirror) / r_m, 1.0), cos_o = dot(way_m, normal) / r_m;
  const double lobe = s.lobe * std::exp(-s.fall * (1 - cos_a));
  if (s.is_emitter) return lobe * spread;
  if (cos_o <= 0) return 0;
  const double cos_i = std::max(dot(mirror, normal), 1e-9);
  return (s.diffuse * cos_o + bounce_up_to(cos_o) + lobe * std::min(1.0, cos_o / cos_i)) * spread;
}

}  // namespace clamor
