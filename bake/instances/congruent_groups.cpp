#include "bake/instances/congruent_groups.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <numeric>
#include <optional>
#include <unordered_map>

#include "common/maths.h"
#include "formats/level/level.h"

namespace clamor {

namespace {

constexpr double kPlace_m = 5e-4, kAxis = 1e-4, kGain = 1e-4, kStart_s = 2e-6;
constexpr std::size_t kMaxPrototypes = 64;  // hash matches to compare in full
constexpr std::uint32_t kUnset = 0xffffffff;

std::uint64_t mixed(std::uint64_t hash, std::uint64_t value) {
  hash = (hash ^ value) * 0x9E3779B97F4A7C15u;
  return hash ^ hash >> 29;
}

// Hash of the exact invariants of congruent groups: emitter count, directivities, and which
// emitters share a signal.
std::uint64_t hash_of(std::span<const Emitter> emitters, std::vector<std::uint32_t>& first_use) {
  std::uint64_t hash = mixed(0, emitters.size());
  std::uint32_t signals = 0;
  for (const Emitter& emitter : emitters) {
    for (const float exponent : emitter.directivity)
      hash = mixed(hash, std::bit_cast<std::uint32_t>(exponent));
    std::uint32_t& label = first_use[emitter.signal];
    if (label == kUnset) label = signals++;
    hash = mixed(hash, label);
  }
  for (const Emitter& emitter : emitters) first_use[emitter.signal] = kUnset;
  return hash;
}

Vec3 middle_of(std::span<const Emitter> emitters) {
  Vec3 sum(0);
  for (const Emitter& emitter : emitters) sum += emitter.position_m;
  return sum / static_cast<double>(emitters.size());
}

// Finds the rotation and uniform scale between two frames; false if the transform has other parts.
bool find_transform(const SceneGroup& prototype, const SceneGroup& group, Instance& instance) {
  if (!(std::abs(glm::determinant(prototype.axes)) > 1e-30)) return false;
  const Matrix transform = group.axes * glm::inverse(prototype.axes);
  const double volume = glm::determinant(transform);
  if (!(volume > 1e-9 && volume < 1 + 1e-5)) return false;
  const double scale = power(volume, 1.0 / 3);
  const Matrix turn = transform / scale;
  const Matrix square = glm::transpose(turn) * turn;
  for (int column = 0; column < 3; ++column)
    for (int row = 0; row < 3; ++row)
      if (!(std::abs(square[column][row] - (column == row ? 1 : 0)) < 1e-4)) return false;
  instance.scale = static_cast<float>(std::abs(scale - 1) < 1e-6 ? 1 : std::min(scale, 1.0));
  instance.rotation = Rotation(glm::normalize(glm::quat_cast(turn)));
  return true;
}

// The instance transform if the groups are congruent within the tolerances, otherwise nothing.
std::optional<Instance> verified_instance(std::span<const Emitter> prototype,
                                          std::span<const Emitter> group, Instance instance,
                                          std::vector<std::uint32_t>& map) {
  const Matrix turn = Placement{}.then(instance).rotation;
  instance.offset_m =
      middle_of(group) - static_cast<double>(instance.scale) * (turn * middle_of(prototype));
  const double first_s = group[0].delay_s - prototype[0].delay_s;
  instance.delay_s = static_cast<float>(std::abs(first_s) < kStart_s ? 0 : first_s);
  double gain = 1;
  for (std::size_t i = 0; i < prototype.size(); ++i)
    if (prototype[i].gain > 0) {
      gain = group[i].gain / prototype[i].gain;
      break;
    }
  instance.gain = static_cast<float>(std::abs(gain - 1) < 1e-7 ? 1 : gain);
  if (!(instance.gain < 1e5f)) return std::nullopt;
  const Placement placed = Placement{}.then(instance);
  std::iota(map.begin(), map.end(), 0u);
  std::vector<bool> mapped(map.size(), false);
  for (std::size_t i = 0; i < prototype.size(); ++i) {
    const Emitter &from = prototype[i], &to = group[i];
    if (!(length(placed.outside(from.position_m) - to.position_m) <= kPlace_m) ||
        !(length(placed.rotation * from.axis - to.axis) <= kAxis) ||
        from.directivity != to.directivity ||
        !(std::abs(instance.gain * from.gain - to.gain) <= kGain * to.gain) ||
        !(std::abs(from.delay_s + placed.delay_s - to.delay_s) <= kStart_s))
      return std::nullopt;
    if (mapped[from.signal] && map[from.signal] != to.signal) return std::nullopt;
    mapped[from.signal] = true;
    map[from.signal] = to.signal;
  }
  return instance;
}

}  // namespace

std::uint32_t UniqueSignalMaps::number_of(const std::vector<std::uint32_t>& map) {
  bool same = true;
  for (std::size_t i = 0; i < map.size(); ++i) same = same && map[i] == i;
  if (same) return kSameSignals;
  const auto [known, is_new] = numbers_.try_emplace(map, static_cast<std::uint32_t>(maps_.size()));
  if (is_new) maps_.push_back(map);
  return known->second;
}

std::vector<Congruence> find_congruent_groups(const Level& level, const SceneGroups& groups,
                                              PrototypeIs prototype_is, UniqueSignalMaps& maps) {
  const auto emitters_of = [&](std::size_t group) {
    return std::span(level.emitters).subspan(groups[group].first, groups[group].size());
  };
  std::vector<std::pair<double, std::size_t>> order;
  for (std::size_t g = 0; g < groups.size(); ++g) {
    double first = static_cast<double>(groups[g].first);
    if (prototype_is == PrototypeIs::kFirstToSound) {
      first = std::numeric_limits<double>::max();
      for (const Emitter& emitter : emitters_of(g)) first = std::min(first, emitter.delay_s);
    }
    order.emplace_back(first, g);
  }
  std::sort(order.begin(), order.end());

  std::vector<Congruence> found(groups.size());
  std::unordered_map<std::uint64_t, std::vector<std::size_t>> prototypes;
  std::vector<std::uint32_t> first_use(level.signals.size(), kUnset), map(level.signals.size());
  for (const auto& [first, g] : order) {
    found[g].prototype = g;
    auto& candidates = prototypes[hash_of(emitters_of(g), first_use)];
    bool is_instance = false;
    for (const std::size_t prototype : candidates) {
      Instance instance;
      if (!find_transform(groups[prototype], groups[g], instance)) continue;
      auto verified = verified_instance(emitters_of(prototype), emitters_of(g), instance, map);
      if (!verified || verified->delay_s < 0) {
        if (!verified || prototype_is == PrototypeIs::kFirstToSound) continue;
      }
      verified->signals = maps.number_of(map);
      found[g] = {prototype, *verified};
      is_instance = true;
      break;
    }
    if (!is_instance && candidates.size() < kMaxPrototypes) candidates.push_back(g);
  }
  return found;
}

}  // namespace clamor
