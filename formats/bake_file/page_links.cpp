#include "formats/bake_file/page_links.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <string>

#include "formats/bake_file/page.h"
#include "formats/bake_file/value_limits.h"

namespace clamor {

namespace {

// Longer than any delay in a level (the import limit is 1000 km), and fits into 32 bits of samples.
constexpr float kLongestDelay_s = 86400;
constexpr std::uint64_t kMaxSources = 1ULL << 48;

struct StoredEntry {
  float low[3], high[3];
  float highest_key;
  float power[kBandCount];
  float cone[4];
  float delay[2];
  std::uint32_t sources, packed_bytes;
  std::uint8_t octant, children;
  std::uint16_t instances;
  std::uint64_t below, offset, hash;
};
static_assert(sizeof(StoredEntry) == kEntryBytes);

struct StoredInstance {
  double offset[3];
  float rotation[4];  // x, y, z, w
  float scale, gain, delay, u;
  std::uint32_t tree, signals, emitters, reserved;
};
static_assert(sizeof(StoredInstance) == kInstanceBytes);

template <class T>
void put(const T& stored, std::vector<std::byte>& bytes) {
  const auto* const from = reinterpret_cast<const std::byte*>(&stored);
  bytes.insert(bytes.end(), from, from + sizeof(T));
}

template <class T>
T take(std::span<const std::byte>& bytes) {
  T stored;
  std::memcpy(&stored, bytes.data(), sizeof(T));
  bytes = bytes.subspan(sizeof(T));
  return stored;
}

PageEntry from_stored(const StoredEntry& stored) {
  PageEntry entry;
  for (int axis = 0; axis < 3; ++axis) {
    entry.low_m[axis] = stored.low[axis];
    entry.high_m[axis] = stored.high[axis];
    entry.cone_axis[axis] = stored.cone[axis];
  }
  entry.cone_cos = stored.cone[3];
  entry.highest_key = stored.highest_key;
  std::copy(std::begin(stored.power), std::end(stored.power), entry.power.begin());
  entry.min_delay_s = stored.delay[0];
  entry.max_delay_s = stored.delay[1];
  entry.source_count = stored.sources;
  entry.octant = stored.octant;
  entry.sources_below = stored.below;
  entry.page = {stored.offset, stored.hash, stored.packed_bytes, stored.children, stored.instances};
  return entry;
}

bool within(float value, float least, float most) { return value >= least && value <= most; }

bool is_inside(const NodeSummary& inner, const NodeSummary& outer) {
  for (int axis = 0; axis < 3; ++axis)
    if (inner.low_m[axis] < outer.low_m[axis] || inner.high_m[axis] > outer.high_m[axis])
      return false;
  return true;
}

Result<void> check_instance(const Instance& instance, const PageEntry& parent,
                            const PageContext& around) {
  const float turn = glm::dot(instance.rotation, instance.rotation);
  if (!(length(instance.offset_m) <= kMaxCoordinateInFile_m) || !within(turn, 0.999f, 1.001f) ||
      !within(instance.scale, 1e-3f, 1) || !within(instance.gain, 0, 1e5f) ||
      !within(instance.delay_s, 0, kLongestDelay_s) ||
      !within(instance.u, std::numeric_limits<float>::min(), 1))
    return Error("has an instance whose values are out of range");
  if (instance.tree >= around.trees.size() ||
      around.trees[instance.tree].page.end() > parent.page.offset)
    return Error("has an instance of a tree that does not precede it");
  if ((instance.signals != kSameSignals && instance.signals >= around.signal_maps) ||
      instance.emitters >= std::max<std::size_t>(1, around.emitters))
    return Error("has an instance with signals or emitters that do not exist");
  return {};
}

}  // namespace

double total_power(const NodeSummary& node) {
  double sum = 0;
  for (const float band : node.power) sum += band;
  return sum;
}

Result<void> check_entry(const PageEntry& entry, std::uint64_t from, std::uint64_t to) {
  for (int axis = 0; axis < 3; ++axis)
    if (!(entry.low_m[axis] >= -kMaxCoordinateInFile_m && entry.low_m[axis] <= entry.high_m[axis] &&
          entry.high_m[axis] <= kMaxCoordinateInFile_m))
      return Error("has bounds that are inverted or out of range");
  for (const float band : entry.power)
    if (!within(band, 0, kMaxPowerInFile)) return Error("has a power out of range");
  for (int axis = 0; axis < 3; ++axis)
    if (!within(entry.cone_axis[axis], -1.001f, 1.001f)) return Error("has a cone out of range");
  if (!within(entry.cone_cos, -1.001f, 1.001f) ||
      !within(entry.highest_key, 0, std::numeric_limits<float>::max()) ||
      !within(entry.min_delay_s, 0, kLongestDelay_s) ||
      !within(entry.max_delay_s, 0, kLongestDelay_s))
    return Error("has a key, a cone or a delay out of range");
  if (entry.octant > 7 && entry.octant != kNoOctant) return Error("has an octant above 7");
  const PageLink& page = entry.page;
  if (entry.source_count > kLeafSources || page.children > kMaxChildren ||
      page.instances > kMaxInstances || entry.sources_below > kMaxSources ||
      entry.sources_below < entry.source_count)
    return Error("declares " + std::to_string(entry.source_count) + " sources, " +
                 std::to_string(page.children) + " children and " + std::to_string(page.instances) +
                 " instances");
  if ((page.packed_bytes == 0) != (entry.source_count == 0) ||
      page.packed_bytes > 2 * max_page_bytes(entry.source_count))
    return Error("declares " + std::to_string(page.packed_bytes) + " bytes for " +
                 std::to_string(entry.source_count) + " sources");
  if (page.offset < from || page.offset > to || page.bytes() > to - page.offset)
    return Error("has a page outside the file or overlapping another part");
  return {};
}

void put_entry(const PageEntry& entry, std::vector<std::byte>& bytes) {
  StoredEntry stored{};
  for (int axis = 0; axis < 3; ++axis) {
    stored.low[axis] = entry.low_m[axis];
    stored.high[axis] = entry.high_m[axis];
    stored.cone[axis] = entry.cone_axis[axis];
  }
  stored.cone[3] = entry.cone_cos;
  stored.highest_key = entry.highest_key;
  std::copy(entry.power.begin(), entry.power.end(), std::begin(stored.power));
  stored.delay[0] = entry.min_delay_s;
  stored.delay[1] = entry.max_delay_s;
  stored.sources = entry.source_count;
  stored.packed_bytes = entry.page.packed_bytes;
  stored.octant = entry.octant;
  stored.children = entry.page.children;
  stored.instances = entry.page.instances;
  stored.below = entry.sources_below;
  stored.offset = entry.page.offset;
  stored.hash = entry.page.hash;
  put(stored, bytes);
}

void put_instance(const Instance& instance, std::vector<std::byte>& bytes) {
  const auto& [x, y, z] = std::array{instance.offset_m.x, instance.offset_m.y, instance.offset_m.z};
  const glm::quat& turn = instance.rotation;
  put(StoredInstance{{x, y, z},
                     {turn.x, turn.y, turn.z, turn.w},
                     instance.scale,
                     instance.gain,
                     instance.delay_s,
                     instance.u,
                     instance.tree,
                     instance.signals,
                     instance.emitters,
                     0},
      bytes);
}

Result<PageEntry> read_entry(std::span<const std::byte> bytes) {
  if (bytes.size() != kEntryBytes) return Error("has the wrong size");
  return from_stored(take<StoredEntry>(bytes));
}

Result<void> read_links(std::span<const std::byte> bytes, const PageEntry& parent,
                        const PageContext& around, PageLinks& links) {
  links.children.clear();
  links.instances.clear();
  if (bytes.size() != parent.page.bytes() - parent.page.packed_bytes)
    return Error("has the wrong size");
  if (parent.page.children > 0 && parent.depth + 1u >= kMaxTreeLevels)
    return Error("has children deeper than " + std::to_string(kMaxTreeLevels) + " levels");
  std::uint64_t below = parent.source_count;
  unsigned octants = 0;
  for (int i = 0; i < parent.page.children; ++i) {
    PageEntry child = from_stored(take<StoredEntry>(bytes));
    child.depth = static_cast<std::uint16_t>(parent.depth + 1);
    child.of_probe = parent.of_probe;
    child.of_zone = parent.of_zone;
    if (const auto good = check_entry(child, kFirstPageOffset, parent.page.offset); !good.ok())
      return Error("has a child that " + good.error().message);
    if (!is_inside(child, parent)) return Error("has a child outside its bounds");
    if (child.highest_key > parent.highest_key) return Error("has a child of a higher key");
    if (child.octant != kNoOctant) {
      if (octants & (1u << child.octant)) return Error("has two children in one octant");
      octants |= 1u << child.octant;
    }
    for (const PageEntry& other : links.children)
      if (child.page.offset < other.page.end() && other.page.offset < child.page.end())
        return Error("has two children on one page");
    below += child.sources_below;
    links.children.push_back(child);
  }
  for (int i = 0; i < parent.page.instances; ++i) {
    const auto stored = take<StoredInstance>(bytes);
    Instance instance;
    instance.tree = stored.tree;
    instance.offset_m = {stored.offset[0], stored.offset[1], stored.offset[2]};
    instance.rotation.x = stored.rotation[0];
    instance.rotation.y = stored.rotation[1];
    instance.rotation.z = stored.rotation[2];
    instance.rotation.w = stored.rotation[3];
    instance.scale = stored.scale;
    instance.gain = stored.gain;
    instance.delay_s = stored.delay;
    instance.u = stored.u;
    instance.signals = stored.signals;
    instance.emitters = stored.emitters;
    if (const auto good = check_instance(instance, parent, around); !good.ok()) return good;
    below += around.trees[instance.tree].sources_below;
    links.instances.push_back(instance);
  }
  if (below != parent.sources_below) return Error("does not partition its sources");
  return {};
}

void include_instances(std::span<const Instance> instances, std::span<const PageEntry> trees,
                       NodeSummary& node) {
  for (const Instance& instance : instances) {
    const PageEntry& tree = trees[instance.tree];
    const Placement placed = Placement{}.then(instance);
    for (unsigned corner = 0; corner < 8; ++corner) {
      const Vec3 at = placed.outside({corner & 1 ? tree.low_m.x : tree.high_m.x,
                                      corner & 2 ? tree.low_m.y : tree.high_m.y,
                                      corner & 4 ? tree.low_m.z : tree.high_m.z});
      // Bounds the rounding errors of floats and of the rotation.
      const Vec3 give(1e-3 + 1e-6 * length(at));
      node.low_m = glm::min(node.low_m, Vec3f(at - give));
      node.high_m = glm::max(node.high_m, Vec3f(at + give));
    }
    const double key = placed.power * total_power(tree) / instance.u * (1 + 1e-6);
    node.highest_key = std::max(node.highest_key, static_cast<float>(key));
    node.min_delay_s = std::min(
        node.min_delay_s, static_cast<float>(placed.delay_s + placed.scale * tree.min_delay_s));
    node.max_delay_s = std::max(
        node.max_delay_s, static_cast<float>(placed.delay_s + placed.scale * tree.max_delay_s));
    for (std::size_t b = 0; b < kBandCount; ++b)
      node.power[b] += static_cast<float>(placed.power * tree.power[b]);
    node.cone_cos = -1;
  }
}

}  // namespace clamor
