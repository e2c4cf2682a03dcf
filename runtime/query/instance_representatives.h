// instance_representatives.h: the source that stands for a distant instance of a tree.
//
// In a tree that has instances, one source has a key above the tree's power: the representative.
// Each instance gives it a key of its own (instance.h). An instance that is so far away that none
// of its other sources reaches the threshold is found as that single source, however many trees
// lie between: it need not be traversed, and its pages need not be in memory. Each tree keeps its
// representative, the position of that in the tree, and the highest key of all other sources.
//
// The representative is found from the top of the tree by following the highest key of each page
// (resident_page.h), through instances within instances.
//
// Threads: the sampler's alone.
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

// The placement of an instance within another.
inline Placement within(const Placement& outer, const Placement& inner) {
  return {outer.rotation * inner.rotation, outer.outside(inner.offset_m),
          outer.scale * inner.scale,       outer.power * inner.power,
          outer.delay_s + inner.delay_s,   outer.emitters + inner.emitters};
}

struct InstanceRepresentative {
  Source source;                // as it is stored
  Placement placement;          // in the tree, of the instance that it is stored in
  std::uint32_t signal = 0;     // in the tree
  std::uint64_t number = 0;     // among the tree's sources
  Vec3 position_m{}, normal{};  // in the tree
  double radius_m = 0;
  double power = 0;       // sum over all bands
  Bands max_intensity{};  // in any direction at 1 m, for a power of 1
  double rest_key = 0;    // upper bound of the keys of all other sources of the tree
};

class InstanceRepresentatives {
 public:
  // All must outlive the object. `page_of` returns null for a page that is not in memory.
  using PageOf = std::function<const ResidentPage*(const PageEntry& entry)>;
  InstanceRepresentatives(const RadiationModel& radiation, std::span<const PageEntry> trees,
                          SignalMaps& maps)
      : radiation_(radiation), trees_(trees), maps_(maps), known_(trees.size()) {}

  // Finds those that are not known, from the pages in memory. Trees without sources, or with
  // missing pages before their first source, stay unknown.
  void update(const PageOf& page_of);

  // Null if it is not known.
  const InstanceRepresentative* of(std::uint32_t tree) const {
    return known_[tree] ? &*known_[tree] : nullptr;
  }

  // Upper bound of the representative's priority with key `key` for a listener at `place`, in the
  // tree's space. `weights` are upper bounds of its signal's; `to_level` scales the tree's metres
  // to the level's.
  double bound(const InstanceRepresentative& representative, const Bands& weights, double key,
               const Vec3& place, double to_level) const;

 private:
  std::optional<InstanceRepresentative> find(const PageEntry& top, const PageOf& page_of) const;
  std::optional<InstanceRepresentative> of_page(const ResidentPage& page) const;
  void finish(InstanceRepresentative& representative) const;

  const RadiationModel& radiation_;
  const std::span<const PageEntry> trees_;
  SignalMaps& maps_;
  std::vector<std::optional<InstanceRepresentative>> known_;
  bool all_known_ = false;
};

}  // namespace clamor
