// congruent_groups.h: which groups of a level's emitters are the same but for where they are.
//
// Two groups are congruent if the n-th emitter of one is the n-th of the other: turned and moved,
// perhaps made smaller, louder by one factor, later by one offset, with one substitution of
// signals, and with the same directivity. What a designer repeats comes in the same order, so no
// matching is needed. How the groups lie to each other follows from their nodes; it is then checked
// emitter by emitter, as a reader of the file will place them:
//
//   position   0.5 mm, an eighth of the file's step      axis   1e-4 rad, below the file's 2.6e-4
//   gain       1e-4 of it, 0.001 dB                      start  2 us, a tenth of a sample
//
// A mirrored group is no copy, nor is one that is larger.
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <span>
#include <vector>

#include "formats/bake_file/instance.h"
#include "formats/level/level.h"
#include "formats/level/scene_group.h"

namespace clamor {

// Signal maps as a bake file has them, each kept once.
class SignalMaps {
 public:
  // Its number; that of no map where nothing is replaced.
  std::uint32_t number_of(const std::vector<std::uint32_t>& map);
  const std::vector<std::vector<std::uint32_t>>& all() const { return maps_; }

 private:
  std::vector<std::vector<std::uint32_t>> maps_;
  std::map<std::vector<std::uint32_t>, std::uint32_t> numbers_;
};

// What a group is a copy of: itself, where it is the first of its kind.
struct Congruence {
  std::size_t model = 0;  // a group that is a model itself
  Instance copy{};        // of its emitters; no tree or numbers yet
};

// Which of a kind comes first, and so is the model.
enum class PrototypeIs { kFirstInList, kFirstToSound };

// One for each group. A copy is never earlier, in what makes it a model, than its model is.
std::vector<Congruence> find_congruent_groups(const Level& level, const SceneGroups& groups,
                                              PrototypeIs model_is, SignalMaps& maps);

}  // namespace clamor
