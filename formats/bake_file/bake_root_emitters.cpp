#include "formats/bake_file/bake_root_emitters.h"

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>

#include "formats/bake_file/bake_contents.h"
#include "formats/bake_file/bake_layout.h"
#include "formats/bake_file/bake_root_values.h"
#include "formats/bake_file/emitter_table.h"
#include "formats/bake_file/value_limits.h"

namespace clamor {

namespace {

using bake_root::read_bands;
using bake_root::text;
using bake_root::write_bands;

class EmitterReader {
 public:
  EmitterReader(BakeRoot::Reader root, std::span<const std::vector<std::uint32_t>> signal_maps,
                std::uint64_t file_bytes)
      : root_(root),
        signal_maps_(signal_maps),
        signals_(root.getSignals().size()),
        file_bytes_(file_bytes) {}

  Result<std::vector<Emitter>> read();

 private:
  Result<void> read_emitter(::Emitter::Reader stored);
  Result<void> read_instanced(::EmitterInstance::Reader stored, NameList& names);
  Result<void> add_emitter(Emitter emitter);

  BakeRoot::Reader root_;
  const std::span<const std::vector<std::uint32_t>> signal_maps_;
  const std::size_t signals_;
  const std::uint64_t file_bytes_;
  std::uint64_t instanced_name_bytes_ = 0;
  std::vector<Emitter> table_;
};

Result<void> EmitterReader::add_emitter(Emitter emitter) {
  if (!(length(emitter.position_m) <= kMaxCoordinateInFile_m) ||
      !(std::abs(length(emitter.axis) - 1) < 1e-3) || !(emitter.gain >= 0 && emitter.gain < 1e10) ||
      !(std::abs(emitter.delay_s) <= 86400) || emitter.signal >= signals_)
    return Error("emitter " + in_quotes(emitter.name) + " is out of range");
  table_.push_back(std::move(emitter));
  return {};
}

Result<void> EmitterReader::read_emitter(::Emitter::Reader stored) {
  Emitter emitter;
  emitter.name = text(stored.getName());
  emitter.position_m = {stored.getX(), stored.getY(), stored.getZ()};
  emitter.axis = {stored.getAxisX(), stored.getAxisY(), stored.getAxisZ()};
  emitter.gain = stored.getGain();
  emitter.signal = stored.getSignal();
  emitter.delay_s = stored.getDelayS();
  const std::string what = "emitter " + in_quotes(emitter.name);
  const auto directivity = read_bands(stored.getDirectivity(), 0, 1000, what);
  if (!directivity.ok()) return directivity.error();
  emitter.directivity = *directivity;
  return add_emitter(std::move(emitter));
}

Result<void> EmitterReader::read_instanced(::EmitterInstance::Reader stored, NameList& names) {
  clamor::EmitterInstance copy;
  copy.at = stored.getAt();
  copy.from = stored.getFrom();
  copy.count = stored.getCount();
  copy.copy.signals = stored.getSignals();
  copy.copy.offset_m = {stored.getOffsetX(), stored.getOffsetY(), stored.getOffsetZ()};
  copy.copy.rotation = Rotation(stored.getRotationW(), stored.getRotationX(), stored.getRotationY(),
                                stored.getRotationZ());
  copy.copy.scale = stored.getScale();
  copy.copy.gain = stored.getGain();
  copy.delay_s = stored.getDelayS();
  if (copy.at != table_.size() || !is_valid(copy, signal_maps_.size()))
    return Error("a run of copied emitters is out of range");
  if (copy.count > max_instanced_emitters(file_bytes_) -
                       std::min<std::uint64_t>(copy.at, max_instanced_emitters(file_bytes_)))
    return Error("it claims more emitters than a file of its size has");
  for (std::uint32_t i = 0; i < copy.count; ++i) {
    Emitter emitter = copied(table_[copy.from + i], copy, signal_maps_);
    if (const auto named = names.next(emitter.name); !named.ok()) return named;
    instanced_name_bytes_ += emitter.name.size();
    if (instanced_name_bytes_ > max_name_bytes(file_bytes_))
      return Error("the names of its copied emitters take more than a file of its size may have");
    if (const auto added = add_emitter(std::move(emitter)); !added.ok()) return added;
  }
  return {};
}

Result<std::vector<Emitter>> EmitterReader::read() {
  const auto stored = root_.getEmitters();
  const auto copies = root_.getEmitterInstances();
  std::vector<std::byte> names;
  if (copies.size() > 0) {
    std::uint64_t count = 0;
    for (const auto copy : copies) count += copy.getCount();
    if (count > max_instanced_emitters(file_bytes_))
      return Error("it claims more emitters than a file of its size has");
    const auto frame = root_.getEmitterNames();
    if (root_.getEmitterNamesBytes() > max_name_bytes(file_bytes_))
      return Error("the names of its emitters claim too much");
    auto list = unpacked(std::as_bytes(std::span(frame.begin(), frame.size())),
                         root_.getEmitterNamesBytes());
    if (!list.ok()) return list.error().in("the names of its emitters");
    names = std::move(*list);
  }
  NameList list(names);
  unsigned next = 0;
  for (const auto copy : copies) {
    for (; table_.size() < copy.getAt() && next < stored.size(); ++next)
      if (const auto read = read_emitter(stored[next]); !read.ok()) return read.error();
    if (const auto read = read_instanced(copy, list); !read.ok()) return read.error();
  }
  for (; next < stored.size(); ++next)
    if (const auto read = read_emitter(stored[next]); !read.ok()) return read.error();
  if (!list.at_end()) return Error("the names of its emitters are too many");
  return std::move(table_);
}

void write_instanced(BakeRoot::Builder root, const std::vector<EmitterInstance>& copies,
                     const std::string& names) {
  auto stored = root.initEmitterInstances(static_cast<unsigned>(copies.size()));
  for (unsigned i = 0; i < stored.size(); ++i) {
    const Instance& copy = copies[i].copy;
    stored[i].setAt(copies[i].at);
    stored[i].setFrom(copies[i].from);
    stored[i].setCount(copies[i].count);
    stored[i].setSignals(copy.signals);
    stored[i].setOffsetX(copy.offset_m.x);
    stored[i].setOffsetY(copy.offset_m.y);
    stored[i].setOffsetZ(copy.offset_m.z);
    stored[i].setRotationX(copy.rotation.x);
    stored[i].setRotationY(copy.rotation.y);
    stored[i].setRotationZ(copy.rotation.z);
    stored[i].setRotationW(copy.rotation.w);
    stored[i].setScale(copy.scale);
    stored[i].setGain(copy.gain);
    stored[i].setDelayS(copies[i].delay_s);
  }
  const auto frame = packed(std::as_bytes(std::span(names)));
  root.setEmitterNames(kj::arrayPtr(reinterpret_cast<const kj::byte*>(frame.data()), frame.size()));
  root.setEmitterNamesBytes(names.size());
}

}  // namespace

void write_emitter_table(BakeRoot::Builder root, const BakeContents& contents,
                         std::uint64_t file_bytes) {
  const std::vector<Emitter>& table = contents.emitters;
  // Encodes instanced emitters as runs unless their number exceeds the limits of the reader.
  std::vector<EmitterInstance> copies;
  if (table.size() <= max_instanced_emitters(file_bytes)) copies = find_emitter_instances(contents);
  if (instanced_name_bytes(table, copies) > max_name_bytes(file_bytes)) copies.clear();
  const std::string names = list_names(table, copies);
  if (names.size() > max_name_bytes(file_bytes)) copies.clear();
  std::size_t told = table.size();
  for (const EmitterInstance& copy : copies) told -= copy.count;
  auto emitters = root.initEmitters(static_cast<unsigned>(told));
  std::size_t next = 0;
  auto copy = copies.begin();
  for (unsigned i = 0; i < emitters.size(); ++i, ++next) {
    for (; copy != copies.end() && copy->at == next; ++copy) next += copy->count;
    const Emitter& emitter = table[next];
    emitters[i].setName(emitter.name);
    emitters[i].setX(emitter.position_m.x);
    emitters[i].setY(emitter.position_m.y);
    emitters[i].setZ(emitter.position_m.z);
    emitters[i].setAxisX(emitter.axis.x);
    emitters[i].setAxisY(emitter.axis.y);
    emitters[i].setAxisZ(emitter.axis.z);
    emitters[i].setGain(emitter.gain);
    write_bands(emitters[i].initDirectivity(kBandCount), emitter.directivity);
    emitters[i].setSignal(emitter.signal);
    emitters[i].setDelayS(emitter.delay_s);
  }
  if (!copies.empty()) write_instanced(root, copies, names);
}

Result<std::vector<Emitter>> read_emitter_table(
    BakeRoot::Reader root, std::span<const std::vector<std::uint32_t>> signal_maps,
    std::uint64_t file_bytes) {
  return EmitterReader(root, signal_maps, file_bytes).read();
}

}  // namespace clamor
