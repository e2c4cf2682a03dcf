#include "bake/instances/emitter_instances.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <utility>

#include "bake/instances/congruent_groups.h"
#include "bake/instances/instance_tree.h"
#include "bake/octree/octree_builder.h"
#include "common/random.h"
#include "formats/bake_file/bake_root_reader.h"
#include "formats/bake_file/page.h"
#include "formats/level/level.h"

namespace clamor {

namespace {

// File size estimates in bytes: an emitter in a page and in the table, an instance in the table,
// and the overhead of a tree.
constexpr double kEmitterBytes = 6, kListedBytes = 150, kListedInstanceBytes = 72, kTreeBytes = 400;
// Minimum group size. Measured with 2000 voices amid 65536 fans (instances_benchmark): instances of
// 4, 8, 16, 64 and 256 fans take the sampler 1.4, 2.2, 1.4, 1.2 and 0.6 times as long as the fans
// alone.
constexpr std::size_t kMinEmitters = 16;
constexpr std::size_t kMaxVariants = 8;
constexpr std::uint32_t kVariant = 0xc0b1e7;  // random number stream
constexpr std::uint32_t kNotStored = 0xffffffff;

// Instances of the same variant select alike, so few instances need few variants.
std::size_t variants_for(std::size_t count) {
  return std::clamp<std::size_t>(count / 2, 2, kMaxVariants);
}

class EmitterInstancer {
 public:
  EmitterInstancer(const Level& level, const SceneGroups& groups, bool reflected,
                   std::uint64_t seed)
      : level_(level), groups_(groups), reflected_(reflected), seed_(seed) {
    found_ = find_congruent_groups(
        level, groups, reflected ? PrototypeIs::kFirstInList : PrototypeIs::kFirstToSound, maps_);
    nest();
    decide();
  }

  EmitterInstances make() {
    EmitterInstances made;
    if (trees_wanted() > kMaxTrees || maps_.all().size() > kMaxSignalMaps)
      std::fill(instanced_.begin(), instanced_.end(), false);
    const Items top = items_of({0, level_.emitters.size()}, top_);
    std::vector<bool> in_file(level_.emitters.size(), reflected_);
    for (const std::uint32_t emitter : top.emitters) in_file[emitter] = true;
    const std::vector<std::size_t> prototypes = prototypes_used(top);
    for (const std::size_t prototype : prototypes)
      for (const std::uint32_t emitter : items_of(prototype).emitters) {
        in_file[emitter] = true;
        ++made.stored;
      }
    made.table_index.assign(level_.emitters.size(), kNotStored);
    for (std::size_t i = 0; i < in_file.size(); ++i)
      if (in_file[i]) {
        made.table_index[i] = static_cast<std::uint32_t>(made.table.size());
        made.table.push_back(level_.emitters[i]);
      }
    for (const std::size_t prototype : prototypes) add_variants(prototype, made);
    for (const std::size_t group : top.groups) {
      made.instances.push_back(instance_of(group, index_in_kind_[group]));
      made.emitters += groups_[group].size();
    }
    draw_instance_u(made.instances, seed_);
    std::vector<bool> used(groups_.size(), false);
    for (const std::size_t prototype : prototypes) used[prototype] = true;
    for (const Congruence& group : found_) made.groups += used[group.prototype] ? 1 : 0;
    made.prototypes = prototypes.size();
    made.alone = top.emitters;
    if (!made.trees.empty()) made.signal_maps = maps_.all();
    return made;
  }

 private:
  // The contents of a group: its own emitters and instanced groups.
  struct Items {
    std::vector<std::uint32_t> emitters;
    std::vector<std::size_t> groups;
  };

  // Finds the children of each group. Inner groups precede the group that contains them.
  void nest() {
    children_.resize(groups_.size());
    for (std::size_t g = 0; g < groups_.size(); ++g) {
      while (!top_.empty() && groups_[top_.back()].first >= groups_[g].first) {
        children_[g].push_back(top_.back());
        top_.pop_back();
      }
      std::reverse(children_[g].begin(), children_[g].end());
      top_.push_back(g);
    }
    index_in_kind_.resize(groups_.size());
    kind_size_.assign(groups_.size(), 0);
    for (std::size_t g = 0; g < groups_.size(); ++g)
      index_in_kind_[g] = kind_size_[found_[g].prototype]++;
  }

  // Decides which prototypes save space, small ones first, because large ones contain them.
  void decide() {
    instanced_.assign(groups_.size(), false);
    std::vector<double> bytes(groups_.size());  // size of each group in the page of its parent
    std::vector<std::size_t> by_size(groups_.size());
    std::iota(by_size.begin(), by_size.end(), 0u);
    std::stable_sort(by_size.begin(), by_size.end(), [&](std::size_t a, std::size_t b) {
      return groups_[a].size() < groups_[b].size();
    });
    const auto own_bytes = [&](std::size_t group) {
      double sum = 0;
      std::size_t below = 0;
      for (const std::size_t child : children_[group]) {
        sum += bytes[child];
        below += groups_[child].size();
      }
      return sum + kEmitterBytes * static_cast<double>(groups_[group].size() - below);
    };
    // All groups of one size, before any larger one.
    for (std::size_t from = 0; from < by_size.size();) {
      std::size_t to = from;
      while (to < by_size.size() && groups_[by_size[to]].size() == groups_[by_size[from]].size())
        bytes[by_size[to]] = own_bytes(by_size[to]), ++to;
      for (std::size_t i = from; i < to; ++i) {
        const std::size_t prototype = by_size[i];
        const std::size_t count = kind_size_[prototype];
        if (count < 2 || groups_[prototype].size() < kMinEmitters) continue;
        const double all = static_cast<double>(count);
        const double trees = static_cast<double>(variants_for(count));
        const double listed = kListedBytes * static_cast<double>(groups_[prototype].size());
        instanced_[prototype] =
            all * bytes[prototype] + (all - 1) * listed >
            all * (kInstanceBytes + kListedInstanceBytes) + trees * (bytes[prototype] + kTreeBytes);
      }
      for (std::size_t i = from; i < to; ++i)
        if (is_instanced(by_size[i])) bytes[by_size[i]] = kInstanceBytes;
      from = to;
    }
  }

  bool is_instanced(std::size_t group) const { return instanced_[found_[group].prototype]; }

  std::size_t trees_wanted() const {
    std::size_t trees = 1;
    for (std::size_t g = 0; g < groups_.size(); ++g)
      if (instanced_[g]) trees += variants_for(kind_size_[g]);
    return trees;
  }

  Items items_of(std::size_t group) const {
    return items_of({groups_[group].first, groups_[group].end}, children_[group]);
  }

  Items items_of(std::pair<std::size_t, std::size_t> range,
                 const std::vector<std::size_t>& children) const {
    Items items;
    std::vector<std::size_t> waiting(children.rbegin(), children.rend());
    std::size_t next = range.first;
    const auto add_until = [&](std::size_t end) {
      for (; next < end; ++next) items.emitters.push_back(static_cast<std::uint32_t>(next));
    };
    while (!waiting.empty()) {
      const std::size_t child = waiting.back();
      waiting.pop_back();
      if (is_instanced(child)) {
        add_until(groups_[child].first);
        items.groups.push_back(child);
        next = groups_[child].end;
      } else {
        waiting.insert(waiting.end(), children_[child].rbegin(), children_[child].rend());
      }
    }
    add_until(range.second);
    return items;
  }

  // The prototypes used at any depth, inner ones first.
  std::vector<std::size_t> prototypes_used(const Items& top) const {
    std::vector<bool> used(groups_.size(), false);
    std::vector<std::size_t> waiting = top.groups;
    while (!waiting.empty()) {
      const std::size_t prototype = found_[waiting.back()].prototype;
      waiting.pop_back();
      if (used[prototype]) continue;
      used[prototype] = true;
      const Items items = items_of(prototype);
      waiting.insert(waiting.end(), items.groups.begin(), items.groups.end());
    }
    std::vector<std::size_t> prototypes;
    for (std::size_t g = 0; g < groups_.size(); ++g)
      if (used[g]) prototypes.push_back(g);
    std::stable_sort(prototypes.begin(), prototypes.end(), [&](std::size_t a, std::size_t b) {
      return groups_[a].size() < groups_[b].size();
    });
    return prototypes;
  }

  // An instance of the group; `turn` selects the variant.
  Instance instance_of(std::size_t group, std::size_t turn) const {
    const Congruence& found = found_[group];
    Instance instance = found.instance;
    instance.tree = static_cast<std::uint32_t>(first_tree_.at(found.prototype) +
                                               turn % variants_for(kind_size_[found.prototype]));
    if (reflected_) {
      instance.emitters =
          static_cast<std::uint32_t>(groups_[group].first - groups_[found.prototype].first);
      instance.delay_s = 0;  // the emitter table holds each emitter's own delay
    }
    return instance;
  }

  void add_variants(std::size_t prototype, EmitterInstances& made) {
    const Items items = items_of(prototype);
    first_tree_.resize(groups_.size());
    first_tree_[prototype] = made.trees.size();
    for (std::size_t v = 0; v < variants_for(kind_size_[prototype]); ++v) {
      std::vector<Source> sources;
      for (const std::uint32_t emitter : items.emitters) {
        Source& source = sources.emplace_back();
        source.emitter = made.table_index[emitter];
        set_from_emitter(source, level_.emitters[emitter]);
      }
      std::vector<Instance> instances;
      for (const std::size_t group : items.groups)
        instances.push_back(instance_of(group, index_in_kind_[group] + v));
      const RandomBits bits = philox(seed_, {static_cast<std::uint32_t>(prototype),
                                             static_cast<std::uint32_t>(v), kVariant, 0});
      draw_prototype_u(sources, instances, made.tops, std::uint64_t{bits[1]} << 32 | bits[0]);
      SourceOctree tree =
          with_instances(build_octree(std::move(sources)), std::move(instances), made.tops);
      made.tops.push_back(root_entry(tree, made.tops));
      made.trees.push_back(std::move(tree));
    }
  }

  const Level& level_;
  const SceneGroups& groups_;
  const bool reflected_;
  const std::uint64_t seed_;
  UniqueSignalMaps maps_;
  std::vector<Congruence> found_;
  std::vector<std::vector<std::size_t>> children_;
  std::vector<std::size_t> top_;  // groups without a parent
  std::vector<std::size_t> index_in_kind_, kind_size_, first_tree_;
  std::vector<bool> instanced_;  // per prototype
};

}  // namespace

EmitterInstances instance_emitters(const Level& level, const SceneGroups& groups, bool reflected,
                                   std::uint64_t seed) {
  return EmitterInstancer(level, groups, reflected, seed).make();
}

}  // namespace clamor
