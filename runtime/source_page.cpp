#include "runtime/source_page.h"

#include <algorithm>
#include <limits>
#include <utility>

namespace clamor {

namespace {

// Floats round positions by up to a millimetre, 10 km from the origin, and the rest by 1e-6.
constexpr float kGive = 0.001f;
constexpr double kSlack = 1.00001;

// (r - g)^2 >= r^2 (1 - g) - g for a give of g metres, because 2 r g <= g r^2 + g.
float nearest2_m2(float r2_m2, float radius2_m2) {
  return std::max(r2_m2 * (1 - kGive) - kGive, radius2_m2);
}

}  // namespace

SourcePage::SourcePage(const SourceField& field, std::span<const Bands> weights,
                       std::vector<Source> sources)
    : sources_(std::move(sources)) {
  for (auto* column : {&x_, &y_, &z_, &radius2_m2_, &highest_}) column->reserve(size());
  ceilings_.reserve(size());
  for (std::size_t i = 0; i < size(); ++i) {
    const Source& source = sources_[i];
    SourceField::Ceiling ceiling = field.ceiling(source, weights[field.signal(source)]);
    const double over_u = kSlack / std::max(source.u, kLeastU);
    ceiling.diffuse = static_cast<float>(ceiling.diffuse * over_u);
    ceiling.lobe = static_cast<float>(ceiling.lobe * over_u);
    const Vec3f& position_m = source.position_m;
    const double radius_m = source_radius_m(source);
    ceilings_.push_back(ceiling);
    x_.push_back(position_m.x);
    y_.push_back(position_m.y);
    z_.push_back(position_m.z);
    radius2_m2_.push_back(static_cast<float>(radius_m * radius_m));
    highest_.push_back(static_cast<float>(ceiling.highest() * kSlack));

    if (i % kBlockSources == 0)
      blocks_.push_back({position_m, position_m, std::numeric_limits<float>::max(), 0});
    Block& block = blocks_.back();
    block.low_m = glm::min(block.low_m, position_m);
    block.high_m = glm::max(block.high_m, position_m);
    block.least_radius2_m2 = std::min(block.least_radius2_m2, radius2_m2_.back());
    block.highest = std::max(block.highest, highest_.back());
  }
}

std::size_t SourcePage::bytes() const {
  return sizeof(SourcePage) + size() * (sizeof(Source) + 5 * sizeof(float) + sizeof ceilings_[0]) +
         blocks_.size() * sizeof(Block);
}

bool SourcePage::screen(std::size_t b, const Vec3f& from, double threshold,
                        std::uint8_t* passes) const {
  const Block& block = blocks_[b];
  const auto least = static_cast<float>(threshold * (1 - 1e-6));
  const Vec3f away = glm::max(glm::max(block.low_m - from, from - block.high_m), Vec3f(0));
  if (block.highest < least * nearest2_m2(glm::dot(away, away), block.least_radius2_m2))
    return false;
  const std::size_t first = b * kBlockSources;
  const std::size_t count = std::min(kBlockSources, size() - first);
  const float* const x = x_.data() + first;
  const float* const y = y_.data() + first;
  const float* const z = z_.data() + first;
  const float* const radius2_m2 = radius2_m2_.data() + first;
  const float* const highest = highest_.data() + first;
  for (std::size_t i = 0; i < count; ++i) {
    const float dx = x[i] - from.x, dy = y[i] - from.y, dz = z[i] - from.z;
    passes[i] = highest[i] >= least * nearest2_m2(dx * dx + dy * dy + dz * dz, radius2_m2[i]);
  }
  return true;
}

}  // namespace clamor
