#include "formats/bake_file/emitter_table.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include "formats/bake_file/bake_contents.h"
#include "formats/bake_file/value_limits.h"

namespace clamor {

namespace {

constexpr double kPlace_m = 5e-4, kAxis = 1e-4, kGain = 1e-4, kStart_s = 2e-6;
constexpr double kLongest_s = 86400;
constexpr char kSameName = 0, kOwnName = 1;

// Range of the emitters of a tree, if contiguous.
struct Run {
  std::uint64_t first = std::numeric_limits<std::uint64_t>::max(), end = 0, count = 0;

  void add(std::uint64_t from, std::uint64_t to, std::uint64_t emitters) {
    first = std::min(first, from);
    end = std::max(end, to);
    count += emitters;
  }
  bool whole() const { return count > 0 && count == end - first; }
};

std::vector<Run> runs_of(const std::vector<SourceOctree>& trees) {
  std::vector<Run> runs;
  for (const SourceOctree& tree : trees) {
    Run run;
    for (const Source& source : tree.sources)
      if (source.is_emitter) run.add(source.emitter, std::uint64_t{source.emitter} + 1, 1);
    for (const Instance& instance : tree.instances) {
      const Run& inner = runs[instance.tree];
      run.add(inner.first + instance.emitters, inner.end + instance.emitters, inner.count);
    }
    runs.push_back(run);
  }
  return runs;
}

bool alike(const Emitter& a, const Emitter& b) {
  return length(a.position_m - b.position_m) <= kPlace_m && length(a.axis - b.axis) <= kAxis &&
         std::abs(a.gain - b.gain) <= kGain * b.gain && a.directivity == b.directivity &&
         a.signal == b.signal && std::abs(a.delay_s - b.delay_s) <= kStart_s;
}

// The instanced run of an instance, if its emitters have their own entries in the table.
std::optional<EmitterInstance> copy_of(const Instance& instance, const Run& run,
                                       const BakeContents& contents) {
  const std::vector<Emitter>& table = contents.emitters;
  if (!run.whole() || instance.emitters < run.count || run.end + instance.emitters > table.size())
    return std::nullopt;
  EmitterInstance copy;
  copy.from = static_cast<std::uint32_t>(run.first);
  copy.count = static_cast<std::uint32_t>(run.count);
  copy.at = copy.from + instance.emitters;
  copy.copy = instance;
  copy.delay_s = table[copy.at].delay_s - table[copy.from].delay_s;
  if (!is_valid(copy, contents.signal_maps.size())) return std::nullopt;
  for (std::size_t i = 0; i < copy.count; ++i)
    if (!alike(copied(table[copy.from + i], copy, contents.signal_maps), table[copy.at + i]))
      return std::nullopt;
  return copy;
}

}  // namespace

std::vector<EmitterInstance> find_emitter_instances(const BakeContents& contents) {
  const std::vector<Run> runs = runs_of(contents.copied);
  std::vector<EmitterInstance> all;
  const auto add = [&](const SourceOctree& tree) {
    for (const Instance& instance : tree.instances)
      if (instance.tree < runs.size())
        if (const auto copy = copy_of(instance, runs[instance.tree], contents))
          all.push_back(*copy);
  };
  for (const SourceOctree& tree : contents.copied) add(tree);
  add(contents.octree);
  // Prefers the largest run at each start; runs inside another are covered by it.
  std::stable_sort(all.begin(), all.end(), [](const EmitterInstance& a, const EmitterInstance& b) {
    return a.at != b.at ? a.at < b.at : a.count > b.count;
  });
  std::vector<EmitterInstance> copies;
  for (const EmitterInstance& copy : all)
    if (copies.empty() || copy.at >= copies.back().at + copies.back().count) copies.push_back(copy);
  return copies;
}

bool is_valid(const EmitterInstance& copy, std::size_t signal_maps) {
  const Instance& how = copy.copy;
  const float turn = glm::dot(how.rotation, how.rotation);
  return copy.count > 0 && copy.from <= copy.at && copy.count <= copy.at - copy.from &&
         length(how.offset_m) <= kMaxCoordinateInFile_m && turn >= 0.999f && turn <= 1.001f &&
         how.scale >= 1e-3f && how.scale <= 1 && how.gain >= 0 && how.gain <= 1e5f &&
         std::abs(copy.delay_s) <= kLongest_s &&
         (how.signals == kSameSignals || how.signals < signal_maps);
}

Emitter copied(const Emitter& emitter, const EmitterInstance& copy,
               std::span<const std::vector<std::uint32_t>> signal_maps) {
  const Placement placed = Placement{}.then(copy.copy);
  Emitter made = emitter;
  made.position_m = placed.outside(emitter.position_m);
  made.axis = glm::normalize(placed.rotation * emitter.axis);
  made.gain = emitter.gain * static_cast<double>(copy.copy.gain);
  made.delay_s = emitter.delay_s + copy.delay_s;
  if (copy.copy.signals != kSameSignals)
    made.signal = signal_maps[copy.copy.signals][emitter.signal];
  return made;
}

std::uint64_t instanced_name_bytes(std::span<const Emitter> table,
                                   std::span<const EmitterInstance> copies) {
  std::uint64_t bytes = 0;
  for (const EmitterInstance& copy : copies)
    for (std::size_t i = 0; i < copy.count; ++i) bytes += table[copy.at + i].name.size();
  return bytes;
}

std::string list_names(std::span<const Emitter> table, std::span<const EmitterInstance> copies) {
  std::string list;
  for (const EmitterInstance& copy : copies)
    for (std::size_t i = 0; i < copy.count; ++i) {
      const std::string& name = table[copy.at + i].name;
      if (name == table[copy.from + i].name) {
        list += kSameName;
      } else {
        list += kOwnName;
        list.append(name.data(), std::min(name.find('\0'), name.size()));
        list += '\0';
      }
    }
  return list;
}

Result<void> NameList::next(std::string& name) {
  const auto at = [this](std::size_t i) { return static_cast<char>(list_[i]); };
  if (at_end()) return Error("the names of its emitters are too few");
  if (at(at_++) == kSameName) return {};
  name.clear();
  for (; !at_end() && at(at_) != '\0'; ++at_) name += at(at_);
  if (at_end()) return Error("the names of its emitters are cut short");
  ++at_;
  return {};
}

}  // namespace clamor
