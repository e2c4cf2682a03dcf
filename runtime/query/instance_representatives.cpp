#include "runtime/query/instance_representatives.h"

#include <algorithm>
#include <numeric>

namespace clamor {

void InstanceRepresentatives::follow(const PageOf& page_of) {
  if (all_known_) return;
  all_known_ = true;
  // Copied trees come before those that copy them. The last one, the level, is not copied.
  for (std::size_t tree = 0; tree + 1 < trees_.size(); ++tree) {
    if (!leads_[tree]) leads_[tree] = lead_of(trees_[tree], page_of);
    all_known_ = all_known_ && leads_[tree];
  }
}

std::optional<InstanceRepresentative> InstanceRepresentatives::lead_of(
    const PageEntry& top, const PageOf& page_of) const {
  double rest_key = 0;
  std::uint64_t number = 0;
  for (const PageEntry* entry = &top;;) {
    const ResidentPage* const page = page_of(*entry);
    if (page == nullptr) return std::nullopt;
    const auto& children = page->links.children;
    using Leader = ResidentPage::Leader;
    const bool is_source = page->leader == Leader::kSource, is_copy = page->leader == Leader::kCopy;
    if (const std::size_t next = is_source ? 1 : 0; next < page->sources.size())
      rest_key = std::max<double>(rest_key, octree_key(page->sources[next]));
    for (std::size_t c = 0; c < children.size(); ++c)
      if (page->leader != Leader::kChild || c != page->leading_child)
        rest_key = std::max<double>(rest_key, children[c].highest_key);
    if (const std::size_t next = is_copy ? 1 : 0; next < page->copies.size())
      rest_key = std::max(rest_key, page->copies[next].key);

    if (page->leader == Leader::kChild) {
      number += entry->source_count;
      for (std::size_t c = 0; c < page->leading_child; ++c) number += children[c].sources_below;
      entry = &children[page->leading_child];
      continue;
    }
    InstanceRepresentative lead;
    if (is_copy) {
      const ResidentInstance& copy = page->copies[0];
      const Instance& instance = page->links.instances[copy.instance];
      const InstanceRepresentative* const inner = of(instance.tree);
      if (inner == nullptr) return std::nullopt;
      lead = *inner;
      lead.placement = within(copy.placement, inner->placement);
      if (instance.signals != kSameSignals)
        lead.signal = maps_.signal(instance.signals, inner->signal);
      number += copy.first + inner->number;
      rest_key = std::max(rest_key, copy.placement.power * inner->rest_key);
    } else {
      if (page->sources.size() == 0) return std::nullopt;
      lead.source = page->sources[0];
      lead.signal = field_.signal(lead.source);
    }
    lead.number = number;
    lead.rest_key = rest_key;
    finish(lead);
    return lead;
  }
}

void InstanceRepresentatives::finish(InstanceRepresentative& lead) const {
  const Placement& placement = lead.placement;
  lead.position_m = placement.outside(Vec3(lead.source.position_m));
  lead.normal = placement.rotation * Vec3(lead.source.normal);
  // The level's tenth of a metre is more than that here, if anything.
  lead.radius_m = std::max(placement.scale * lead.source.patch_radius_m, kEmitterRadius_m);
  const double stored = std::accumulate(lead.source.power.begin(), lead.source.power.end(), 0.0);
  lead.power = placement.power * stored;
  lead.most = field_.max_intensity(lead.source);
  for (float& band : lead.most) band = stored > 0 ? static_cast<float>(band / stored) : 0;
}

}  // namespace clamor
