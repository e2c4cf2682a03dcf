#include "runtime/query/instance_representatives.h"

#include <algorithm>
#include <cmath>

#include "runtime/propagation/tolerances.h"

namespace clamor {

namespace {

// Upper bound of the keys in the node and below but for the highest one.
double rest_key_of(const ResidentPage& page) {
  using HighestKeyIn = ResidentPage::HighestKeyIn;
  double key = 0;
  if (const std::size_t next = page.highest_key_in == HighestKeyIn::kSource ? 1 : 0;
      next < page.sources.size())
    key = std::max<double>(key, octree_key(page.sources[next]));
  const auto& children = page.links.children;
  for (std::size_t c = 0; c < children.size(); ++c)
    if (page.highest_key_in != HighestKeyIn::kChild || c != page.highest_key_child)
      key = std::max<double>(key, children[c].highest_key);
  if (const std::size_t next = page.highest_key_in == HighestKeyIn::kInstance ? 1 : 0;
      next < page.instances.size())
    key = std::max(key, page.instances[next].key);
  return key;
}

}  // namespace

void InstanceRepresentatives::update(const PageOf& page_of) {
  if (all_known_) return;
  all_known_ = true;
  // Trees come before those that have instances of them. The last one, the level, has no instances.
  for (std::size_t tree = 0; tree + 1 < trees_.size(); ++tree) {
    if (!known_[tree]) known_[tree] = find(trees_[tree], page_of);
    all_known_ = all_known_ && known_[tree];
  }
}

std::optional<InstanceRepresentative> InstanceRepresentatives::find(const PageEntry& top,
                                                                    const PageOf& page_of) const {
  double rest_key = 0;
  std::uint64_t number = 0;
  const PageEntry* entry = &top;
  const ResidentPage* page = page_of(top);
  for (; page != nullptr && page->highest_key_in == ResidentPage::HighestKeyIn::kChild;
       page = page_of(*entry)) {
    rest_key = std::max(rest_key, rest_key_of(*page));
    const auto& children = page->links.children;
    number += entry->source_count;
    for (std::size_t c = 0; c < page->highest_key_child; ++c) number += children[c].sources_below;
    entry = &children[page->highest_key_child];
  }
  if (page == nullptr) return std::nullopt;
  auto found = of_page(*page);
  if (!found) return std::nullopt;
  found->number += number;
  found->rest_key = std::max({found->rest_key, rest_key, rest_key_of(*page)});
  finish(*found);
  return found;
}

// The first source of a page, or the representative of its first instance.
std::optional<InstanceRepresentative> InstanceRepresentatives::of_page(
    const ResidentPage& page) const {
  if (page.highest_key_in == ResidentPage::HighestKeyIn::kSource) {
    if (page.sources.size() == 0) return std::nullopt;
    InstanceRepresentative first;
    first.source = page.sources[0];
    first.signal = radiation_.signal(first.source);
    return first;
  }
  const ResidentInstance& resident = page.instances[0];
  const Instance& instance = page.links.instances[resident.instance];
  const InstanceRepresentative* const inner = of(instance.tree);
  if (inner == nullptr) return std::nullopt;
  InstanceRepresentative outer = *inner;
  outer.placement = within(resident.placement, inner->placement);
  if (instance.signals != kSameSignals)
    outer.signal = maps_.signal(instance.signals, inner->signal);
  outer.number += resident.first;
  outer.rest_key = resident.placement.power * inner->rest_key;
  return outer;
}

void InstanceRepresentatives::finish(InstanceRepresentative& representative) const {
  const Placement& placement = representative.placement;
  const Source& source = representative.source;
  representative.position_m = placement.outside(Vec3(source.position_m));
  representative.normal = placement.rotation * Vec3(source.normal);
  // The level's tenth of a metre is more than that here, if anything.
  representative.radius_m = std::max(placement.scale * source.patch_radius_m, kEmitterRadius_m);
  const double stored = sum_of(source.power);
  representative.power = placement.power * stored;
  representative.max_intensity = radiation_.max_intensity(source);
  for (float& band : representative.max_intensity)
    band = stored > 0 ? static_cast<float>(band / stored) : 0;
}

double InstanceRepresentatives::bound(const InstanceRepresentative& representative,
                                      const Bands& weights, double key, const Vec3& place,
                                      double to_level) const {
  const Vec3 to_listener = place - representative.position_m;
  const double distance_m = length(to_listener), error_m = query::kRepresentativeError_m;
  if (!representative.source.is_emitter &&
      dot(to_listener, representative.normal) < -1e-5 * distance_m - error_m)
    return 0;
  const double near_m = std::max(distance_m - error_m, representative.radius_m);
  const Bands transmittance = air_transmittance(radiation_.air_loss_per_m(), near_m * to_level);
  double sum = 0;
  for (std::size_t b = 0; b < kBandCount; ++b)
    sum += static_cast<double>(weights[b]) * representative.max_intensity[b] * transmittance[b];
  return query::kRepresentativeSlack * key * sum / (near_m * near_m);
}

}  // namespace clamor
