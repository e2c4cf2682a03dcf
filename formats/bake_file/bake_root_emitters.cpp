#include "formats/bake_file/bake_root_emitters.h"

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>

#include "common/memory_size.h"
#include "formats/bake_file/bake_contents.h"
#include "formats/bake_file/bake_layout.h"
#include "formats/bake_file/bake_root_values.h"
#include "formats/bake_file/emitter_table.h"
#include "formats/bake_file/value_limits.h"

namespace clamor {

namespace {

using bake_root::read_bands;
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
  emitter.name = bake_root::name(stored.getName());
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
  clamor::EmitterInstance run;
  run.at = stored.getAt();
  run.from = stored.getFrom();
  run.count = stored.getCount();
  run.transform.signals = stored.getSignals();
  run.transform.offset_m = {stored.getOffsetX(), stored.getOffsetY(), stored.getOffsetZ()};
  run.transform.rotation = Rotation(stored.getRotationW(), stored.getRotationX(),
                                    stored.getRotationY(), stored.getRotationZ());
  run.transform.scale = stored.getScale();
  run.transform.gain = stored.getGain();
  run.delay_s = stored.getDelayS();
  if (run.at != table_.size() || !is_valid(run, signal_maps_.size()))
    return Error("a run of instanced emitters is out of range");
  if (run.count > max_instanced_emitters(file_bytes_) -
                      std::min<std::uint64_t>(run.at, max_instanced_emitters(file_bytes_)))
    return Error("it claims more emitters than a file of its size has");
  for (std::uint32_t i = 0; i < run.count; ++i) {
    Emitter emitter = instantiate(table_[run.from + i], run, signal_maps_);
    if (const auto named = names.next(emitter.name); !named.ok()) return named;
    instanced_name_bytes_ += emitter.name.size();
    if (instanced_name_bytes_ > max_name_bytes(file_bytes_))
      return Error(
          "the names of its instanced emitters take more than a file of its size may have");
    if (const auto added = add_emitter(std::move(emitter)); !added.ok()) return added;
  }
  return {};
}

Result<std::vector<Emitter>> EmitterReader::read() {
  const auto stored = root_.getEmitters();
  const auto runs = root_.getEmitterInstances();
  std::vector<std::byte> names;
  if (runs.size() > 0) {
    std::uint64_t count = 0;
    for (const auto run : runs) count += run.getCount();
    if (count > max_instanced_emitters(file_bytes_))
      return Error("it claims more emitters than a file of its size has");
    const auto frame = root_.getEmitterNames();
    if (root_.getEmitterNamesBytes() > max_name_bytes(file_bytes_))
      return Error("the names of its emitters claim too many bytes");
    auto list = unpacked(std::as_bytes(std::span(frame.begin(), frame.size())),
                         memory_size(root_.getEmitterNamesBytes()));
    if (!list.ok()) return list.error().in("the names of its emitters");
    names = std::move(*list);
  }
  NameList list(names);
  unsigned next = 0;
  for (const auto run : runs) {
    for (; table_.size() < run.getAt() && next < stored.size(); ++next)
      if (const auto read = read_emitter(stored[next]); !read.ok()) return read.error();
    if (const auto read = read_instanced(run, list); !read.ok()) return read.error();
  }
  for (; next < stored.size(); ++next)
    if (const auto read = read_emitter(stored[next]); !read.ok()) return read.error();
  if (!list.at_end()) return Error("the names of its emitters are too many");
  return std::move(table_);
}

void write_instanced(BakeRoot::Builder root, const std::vector<EmitterInstance>& runs,
                     const std::string& names) {
  auto stored = root.initEmitterInstances(static_cast<unsigned>(runs.size()));
  for (unsigned i = 0; i < stored.size(); ++i) {
    const Instance& transform = runs[i].transform;
    stored[i].setAt(runs[i].at);
    stored[i].setFrom(runs[i].from);
    stored[i].setCount(runs[i].count);
    stored[i].setSignals(transform.signals);
    stored[i].setOffsetX(transform.offset_m.x);
    stored[i].setOffsetY(transform.offset_m.y);
    stored[i].setOffsetZ(transform.offset_m.z);
    stored[i].setRotationX(transform.rotation.x);
    stored[i].setRotationY(transform.rotation.y);
    stored[i].setRotationZ(transform.rotation.z);
    stored[i].setRotationW(transform.rotation.w);
    stored[i].setScale(transform.scale);
    stored[i].setGain(transform.gain);
    stored[i].setDelayS(runs[i].delay_s);
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
  std::vector<EmitterInstance> runs;
  if (table.size() <= max_instanced_emitters(file_bytes)) runs = find_emitter_instances(contents);
  if (instanced_name_bytes(table, runs) > max_name_bytes(file_bytes)) runs.clear();
  const std::string names = list_names(table, runs);
  if (names.size() > max_name_bytes(file_bytes)) runs.clear();
  std::size_t count = table.size();
  for (const EmitterInstance& run : runs) count -= run.count;
  auto emitters = root.initEmitters(static_cast<unsigned>(count));
  std::size_t next = 0;
  auto run = runs.begin();
  for (unsigned i = 0; i < emitters.size(); ++i, ++next) {
    for (; run != runs.end() && run->at == next; ++run) next += run->count;
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
  if (!runs.empty()) write_instanced(root, runs, names);
}

Result<std::vector<Emitter>> read_emitter_table(
    BakeRoot::Reader root, std::span<const std::vector<std::uint32_t>> signal_maps,
    std::uint64_t file_bytes) {
  return EmitterReader(root, signal_maps, file_bytes).read();
}

}  // namespace clamor
