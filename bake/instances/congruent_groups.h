// congruent_groups.h: finds groups of emitters that are transformed copies of each other.
//
// Two groups are congruent if the n-th emitter of one matches the n-th of the other under a rigid
// transform, a uniform scale of at most 1, one gain factor, one time offset and one substitution of
// signals, with equal directivities. Repeated objects list their emitters in the same order, so no
// matching is needed. The transform follows from the groups' nodes and is then verified emitter by
// emitter, as a reader of the file will place them, to
//
//   position   0.5 mm, an eighth of the file's step      axis   1e-4 rad, below the file's 2.6e-4
//   gain       1e-4 of it, 0.001 dB                      start  2 us, a tenth of a sample
//
// Mirrored and enlarged groups are not congruent.
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <span>
#include <vector>

#include "formats/bake_file/instance.h"
#include "formats/level/scene_group.h"

namespace clamor {

struct Level;

// The unique signal substitutions of a bake file.
class UniqueSignalMaps {
 public:
  // Index of the map, added if new; kSameSignals for the identity.
  std::uint32_t number_of(const std::vector<std::uint32_t>& map);
  const std::vector<std::vector<std::uint32_t>>& all() const { return maps_; }

 private:
  std::vector<std::vector<std::uint32_t>> maps_;
  std::map<std::vector<std::uint32_t>, std::uint32_t> numbers_;
};

// The prototype of a group and the transform from it. A prototype refers to itself.
struct Congruence {
  std::size_t prototype = 0;  // a group that is a prototype
  Instance instance{};        // transform of the emitters; tree, u and emitter offset are unset
};

// The rule that selects the prototype among congruent groups.
enum class PrototypeIs { kFirstInList, kFirstToSound };

// Returns one entry per group. A prototype comes before its instances in the order that
// `prototype_is` names.
std::vector<Congruence> find_congruent_groups(const Level& level, const SceneGroups& groups,
                                              PrototypeIs prototype_is, UniqueSignalMaps& maps);

}  // namespace clamor
