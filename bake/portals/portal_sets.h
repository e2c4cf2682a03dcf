// portal_sets.h: numbers the sets of portals that the paths of a bake have passed.
//
// A bake file holds at most kMaxPortalSets of them. Sets get numbers by descending power of their
// sources; one that finds no room counts as its largest subset that has a number, so its sound is
// heard through fewer portals than it passed.
//
// All results depend on the sources and their order alone.
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <span>
#include <unordered_map>
#include <vector>

#include "formats/bake_file/baked_portals.h"
#include "formats/bake_file/source.h"
#include "formats/level/portal.h"

namespace clamor {

class PortalSetTable {
 public:
  PortalSetTable() : numbers_{{PortalSet{}, 0}} {}

  // The number of a set, which is added if there are fewer than `max_sets`; otherwise that of its
  // largest subset in the table.
  std::uint32_t number_of(const PortalSet& set, std::size_t max_sets = kMaxPortalSets);

  // The number of each set, in which those of the highest power are added first.
  std::vector<std::uint32_t> numbers_of(std::span<const PortalSet> sets,
                                        std::span<const double> powers,
                                        std::size_t max_sets = kMaxPortalSets);

  const std::vector<PortalSet>& sets() const { return sets_; }

 private:
  std::vector<PortalSet> sets_{PortalSet{}};
  std::map<PortalSet, std::uint32_t> numbers_;
};

// The virtual emitters of the sources of a level's emitters. While sources are thinned, there is
// one for each pair of an emitter and a set that occurs; number() keeps those that are left.
class PortalPairs {
 public:
  explicit PortalPairs(std::size_t emitters) : emitters_(emitters) {}

  // Whether any source has passed a portal; if none has, count() and number() have nothing to do.
  bool has_any() const { return !pairs_.empty(); }

  // The provisional number of the virtual emitter; the emitter itself for the empty set.
  std::uint32_t number_of(std::uint32_t emitter, const PortalSet& set);

  // The sources come in several spans: count() for all, number() once, then apply() for all.
  void count(std::span<const Source> sources);
  // Adds the sources' sets to the table and the virtual emitters that are left to `made`.
  void number(PortalSetTable& table, std::size_t max_sets, std::vector<PortalEmitter>& made);
  // Makes the sources refer to these.
  void apply(std::span<Source> sources) const;

 private:
  struct Pair {
    std::uint32_t emitter = 0;
    PortalSet set;

    bool operator==(const Pair&) const = default;
  };
  struct HashOfPair {
    std::size_t operator()(const Pair& pair) const;
  };

  std::size_t emitters_;
  std::vector<Pair> pairs_;
  std::unordered_map<Pair, std::uint32_t, HashOfPair> numbers_;
  std::map<PortalSet, double> power_of_set_;  // of the counted sources
  std::vector<std::uint8_t> is_used_;         // by pair
  std::vector<std::uint32_t> finals_;         // emitter by pair, of those used
};

// The sets of the sources of a probe's tree.
class ProbePortalSets {
 public:
  // The path with this first leg and a provisional set.
  ProbePath path_of(std::uint32_t first_leg, const PortalSet& set);

  // Adds the sources' sets to the table, and replaces provisional numbers by those of the table.
  void finish(std::span<Source> sources, PortalSetTable& table);

 private:
  PortalSetTable provisional_;
};

}  // namespace clamor
