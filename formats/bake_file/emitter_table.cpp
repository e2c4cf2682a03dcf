#include "formats/bake_file/emitter_table.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include "common/name_length.h"
#include "formats/bake_file/bake_contents.h"
#include "formats/bake_file/value_limits.h"

namespace clamor {

namespace {

constexpr double kPlace_m = 5e-4, kAxis = 1e-4, kGain = 1e-4, kStart_s = 2e-6;
constexpr double kLongest_s = 86400;
constexpr char kSameName = 0, kOwnName = 1;

// Range of the emitters of a tree, if contiguous.
struct EmitterRange {
  std::uint64_t first = std::numeric_limits<std::uint64_t>::max(), end = 0, count = 0;

  void add(std::uint64_t from, std::uint64_t to, std::uint64_t emitters) {
    first = std::min(first, from);
    end = std::max(end, to);
    count += emitters;
  }
  bool whole() const { return count > 0 && count == end - first; }
};

std::vector<EmitterRange> emitter_ranges(const std::vector<SourceOctree>& trees) {
  std::vector<EmitterRange> ranges;
  for (const SourceOctree& tree : trees) {
    EmitterRange range;
    for (const Source& source : tree.sources)
      if (source.is_emitter) range.add(source.emitter, std::uint64_t{source.emitter} + 1, 1);
    for (const Instance& instance : tree.instances) {
      const EmitterRange& inner = ranges[instance.tree];
      range.add(inner.first + instance.emitters, inner.end + instance.emitters, inner.count);
    }
    ranges.push_back(range);
  }
  return ranges;
}

bool alike(const Emitter& a, const Emitter& b) {
  return length(a.position_m - b.position_m) <= kPlace_m && length(a.axis - b.axis) <= kAxis &&
         std::abs(a.gain - b.gain) <= kGain * b.gain && a.directivity == b.directivity &&
         a.signal == b.signal && std::abs(a.delay_s - b.delay_s) <= kStart_s;
}

// The instanced run of an instance, if its emitters have their own entries in the table.
std::optional<EmitterInstance> instanced_run(const Instance& instance, const EmitterRange& range,
                                             const BakeContents& contents) {
  const std::vector<Emitter>& table = contents.emitters;
  if (!range.whole() || instance.emitters < range.count ||
      range.end + instance.emitters > table.size())
    return std::nullopt;
  EmitterInstance run;
  run.from = static_cast<std::uint32_t>(range.first);
  run.count = static_cast<std::uint32_t>(range.count);
  run.at = run.from + instance.emitters;
  run.transform = instance;
  run.delay_s = table[run.at].delay_s - table[run.from].delay_s;
  if (!is_valid(run, contents.signal_maps.size())) return std::nullopt;
  for (std::size_t i = 0; i < run.count; ++i)
    if (!alike(instantiate(table[run.from + i], run, contents.signal_maps), table[run.at + i]))
      return std::nullopt;
  return run;
}

}  // namespace

std::vector<EmitterInstance> find_emitter_instances(const BakeContents& contents) {
  const std::vector<EmitterRange> ranges = emitter_ranges(contents.prototypes);
  std::vector<EmitterInstance> all;
  const auto add = [&](const SourceOctree& tree) {
    for (const Instance& instance : tree.instances)
      if (instance.tree < ranges.size())
        if (const auto run = instanced_run(instance, ranges[instance.tree], contents))
          all.push_back(*run);
  };
  for (const SourceOctree& tree : contents.prototypes) add(tree);
  add(contents.octree);
  // Prefers the largest run at each start; runs inside another are covered by it.
  std::stable_sort(all.begin(), all.end(), [](const EmitterInstance& a, const EmitterInstance& b) {
    return a.at != b.at ? a.at < b.at : a.count > b.count;
  });
  std::vector<EmitterInstance> runs;
  for (const EmitterInstance& run : all)
    if (runs.empty() || run.at >= runs.back().at + runs.back().count) runs.push_back(run);
  return runs;
}

bool is_valid(const EmitterInstance& run, std::size_t signal_maps) {
  const Instance& how = run.transform;
  const float turn = glm::dot(how.rotation, how.rotation);
  return run.count > 0 && run.from <= run.at && run.count <= run.at - run.from &&
         length(how.offset_m) <= kMaxCoordinateInFile_m && turn >= 0.999f && turn <= 1.001f &&
         how.scale >= 1e-3f && how.scale <= 1 && how.gain >= 0 && how.gain <= 1e5f &&
         std::abs(run.delay_s) <= kLongest_s &&
         (how.signals == kSameSignals || how.signals < signal_maps);
}

Emitter instantiate(const Emitter& emitter, const EmitterInstance& run,
                    std::span<const std::vector<std::uint32_t>> signal_maps) {
  const Placement placed = Placement{}.then(run.transform);
  Emitter made = emitter;
  made.position_m = placed.outside(emitter.position_m);
  made.axis = glm::normalize(placed.rotation * emitter.axis);
  made.gain = emitter.gain * static_cast<double>(run.transform.gain);
  made.delay_s = emitter.delay_s + run.delay_s;
  if (run.transform.signals != kSameSignals)
    made.signal = signal_maps[run.transform.signals][emitter.signal];
  return made;
}

std::uint64_t instanced_name_bytes(std::span<const Emitter> table,
                                   std::span<const EmitterInstance> runs) {
  std::uint64_t bytes = 0;
  for (const EmitterInstance& run : runs)
    for (std::size_t i = 0; i < run.count; ++i) bytes += table[run.at + i].name.size();
  return bytes;
}

std::string list_names(std::span<const Emitter> table, std::span<const EmitterInstance> runs) {
  std::string list;
  for (const EmitterInstance& run : runs)
    for (std::size_t i = 0; i < run.count; ++i) {
      const std::string& name = table[run.at + i].name;
      if (name == table[run.from + i].name) {
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
  shorten(name);
  return {};
}

}  // namespace clamor
