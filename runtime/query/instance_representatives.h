// instance_representatives.h: which source of a copied tree is heard from afar, and how little the
// rest is.
//
// Of a tree that is copied one source has a key above the tree's power, its representative
// (instance.h), and the copy gives that one a key of its own. A copy that is too far away for any
// other source of it is then a single source, however many trees lie between its top and that
// source: it need not be walked, and its pages need not be here. So of each tree are kept the
// representative, where it stands in the tree, and the highest key that any other source has.
//
// Found by following from the top what leads each page (resident_page.h), through copies within
// copies. Not thread-safe: the sampler's.
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <vector>

#include "formats/bake_file/instance.h"
#include "formats/bake_file/page_links.h"
#include "runtime/propagation/radiation_model.h"
#include "runtime/propagation/signal_maps.h"
#include "runtime/streaming/resident_page.h"

namespace clamor {

// Where a copy is that stands within another.
inline Placement within(const Placement& outer, const Placement& inner) {
  return {outer.rotation * inner.rotation, outer.outside(inner.offset_m),
          outer.scale * inner.scale,       outer.power * inner.power,
          outer.delay_s + inner.delay_s,   outer.emitters + inner.emitters};
}

struct InstanceRepresentative {
  Source source;             // as it is stored,
  Placement placement;       // and where what it is stored with stands in the tree
  std::uint32_t signal = 0;  // in the tree
  std::uint64_t number = 0;  // of the tree's sources
  Vec3 position_m{};         // in the tree, as are
  Vec3 normal{};
  double radius_m = 0;  // of the source,
  double power = 0;     // over all bands,
  Bands most{};         // and the most that it radiates into a direction, for a power of 1
  double rest_key = 0;  // that no other source of the tree exceeds
};

class InstanceRepresentatives {
 public:
  // All must outlive the object. `page_of` gives null for a page that is not here.
  using PageOf = std::function<const ResidentPage*(const PageEntry& entry)>;
  InstanceRepresentatives(const RadiationModel& field, std::span<const PageEntry> trees,
                          SignalMaps& maps)
      : field_(field), trees_(trees), maps_(maps), leads_(trees.size()) {}

  // Looks for those that are not known, in what pages are here now. Trees that have no sources, or
  // none before pages that are missing, stay unknown.
  void follow(const PageOf& page_of);

  // Null if it is not known.
  const InstanceRepresentative* of(std::uint32_t tree) const {
    return leads_[tree] ? &*leads_[tree] : nullptr;
  }

 private:
  std::optional<InstanceRepresentative> lead_of(const PageEntry& top, const PageOf& page_of) const;
  void finish(InstanceRepresentative& lead) const;

  const RadiationModel& field_;
  const std::span<const PageEntry> trees_;
  SignalMaps& maps_;
  std::vector<std::optional<InstanceRepresentative>> leads_;
  bool all_known_ = false;
};

}  // namespace clamor
