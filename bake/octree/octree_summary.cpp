#include "bake/octree/octree_summary.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "common/maths.h"

namespace clamor {

void summarise(NodeSummary& node, std::span<const Source> own,
               std::span<const NodeSummary* const> children) {
  constexpr float kHuge = 1e30f;
  node.low_m = Vec3f(kHuge);
  node.high_m = Vec3f(-kHuge);
  node.min_delay_s = kHuge;
  node.max_delay_s = 0;
  std::array<double, kBandCount> power{};
  Vec3 axis(0);

  bool everywhere = false;  // whether any source is omnidirectional
  for (const Source& source : own) {
    node.low_m = glm::min(node.low_m, source.position_m);
    node.high_m = glm::max(node.high_m, source.position_m);
    node.min_delay_s = std::min(node.min_delay_s, source.delay_s);
    node.max_delay_s = std::max(node.max_delay_s, source.delay_s);
    for (std::size_t b = 0; b < kBandCount; ++b) power[b] += source.power[b];
    axis += Vec3(source.normal);
    everywhere |= source.is_emitter;
  }
  node.highest_key = own.empty() ? 0 : octree_key(own.front());
  node.cone_cos = -1;

  for (const NodeSummary* child : children) {
    node.highest_key = std::max(node.highest_key, child->highest_key);
    node.low_m = glm::min(node.low_m, child->low_m);
    node.high_m = glm::max(node.high_m, child->high_m);
    node.min_delay_s = std::min(node.min_delay_s, child->min_delay_s);
    node.max_delay_s = std::max(node.max_delay_s, child->max_delay_s);
    for (std::size_t b = 0; b < kBandCount; ++b) power[b] += child->power[b];
    axis += Vec3(child->cone_axis);
    everywhere |= child->cone_cos <= -1;
  }
  for (std::size_t b = 0; b < kBandCount; ++b) node.power[b] = static_cast<float>(power[b]);

  // Half angle of the cone; a surface radiates up to 90 degrees from its normal.
  const double length_of_axis = length(axis);
  if (everywhere || length_of_axis < 1e-6) return;
  node.cone_axis = Vec3f(axis / length_of_axis);
  double widest = 0;
  const auto angle_to = [&node](const Vec3f& v) {
    return acos_of(std::clamp(static_cast<double>(dot(v, node.cone_axis)), -1.0, 1.0));
  };
  for (const Source& source : own)
    widest = std::max(widest, angle_to(source.normal) + std::numbers::pi / 2);
  for (const NodeSummary* child : children)
    widest = std::max(widest, angle_to(child->cone_axis) + acos_of(child->cone_cos));
  if (widest < std::numbers::pi) node.cone_cos = static_cast<float>(cos_of(widest) - 1e-6);
}

}  // namespace clamor
