// bake_writer.cpp: implementation of bake_writer.h.
//
// Order: preamble, pages in node order, signals, geometry, root. The preamble is rewritten last.
#include "formats/bake_file/bake_writer.h"

#include <algorithm>

#include <capnp/message.h>
#include <capnp/serialize.h>
#include <tbb/info.h>
#include <tbb/task_arena.h>

#include "formats/audio/audio_file.h"
#include "formats/bake_file/bake_check.h"
#include "formats/bake_file/bake_contents.h"
#include "formats/bake_file/bake_layout.h"
#include "formats/bake_file/bake_root.capnp.h"
#include "formats/bake_file/bake_root_reader.h"
#include "formats/bake_file/emitter_table.h"
#include "formats/bake_file/geometry_section.h"
#include "formats/bake_file/octree_writer.h"
#include "formats/bake_file/section_writer.h"
#include "formats/bake_file/signal_envelope.h"
#include "formats/bake_file/signal_section.h"
#include "formats/bake_file/source_quantization.h"

namespace clamor {

namespace {

struct SignalSections {
  float scale = 1;
  std::vector<FileSection> blocks;
  Bands mean_square{};
  FileSection envelope;
};

struct Sections {
  std::vector<SignalSections> signals;
  FileSection geometry;  // empty; used by format 3.0 only
  Vec3 geometry_low_m{};
  std::vector<StoredGeometryPage> geometry_pages;
  std::uint64_t bytes_before_root = 0;
};

// Writes the instanced trees first, then the level's.
Result<void> write_trees(const BakeContents& contents, OctreeWriter& writer) {
  if (contents.octree.nodes.empty() && !contents.stream_octree) return {};
  for (const SourceOctree& tree : contents.copied)
    if (const auto done = writer.write(tree); !done.ok()) return done;
  if (!contents.stream_octree) return writer.write(contents.octree);
  auto top = contents.stream_octree(writer);
  if (!top.ok()) return top.error();
  if (!contents.octree.nodes.empty()) {
    const auto beside = writer.add_subtree(SourceOctree(contents.octree));
    if (!beside.ok()) return beside.error();
    const auto both = *top ? writer.add_above(**top, *beside) : beside;
    if (!both.ok()) return both.error();
    *top = *both;
  }
  if (*top) writer.finish(**top);
  return {};
}

Result<void> write_signals(const std::vector<Signal>& signals, SectionWriter& appender,
                           Sections& sections) {
  for (const Signal& signal : signals) {
    SignalSections& kept = sections.signals.emplace_back();
    kept.scale = signal_scale(signal);
    const auto blocks = pack_signal_blocks(signal, kept.scale);
    if (!blocks.ok()) return blocks.error().in("signal " + in_quotes(signal.name));
    for (const auto& block : *blocks) {
      const auto section = appender.append(block);
      if (!section.ok()) return section.error();
      kept.blocks.push_back(*section);
    }
    const SignalEnvelope envelope(signal);
    kept.mean_square = envelope.mean_square();
    const auto section = appender.append(pack_envelope(envelope));
    if (!section.ok()) return section.error();
    kept.envelope = *section;
  }
  return {};
}

Result<void> write_geometry(const Mesh& mesh, SectionWriter& appender, Sections& sections) {
  const auto before = appender.append({});
  if (!before.ok()) return before.error();
  sections.geometry = *before;
  PackedGeometry packed = pack_geometry(mesh);
  sections.geometry_low_m = packed.low_m;
  for (const PackedGeometryPage& page : packed.pages) {
    const auto section = appender.append(page.frame);
    if (!section.ok()) return section.error();
    sections.geometry_pages.push_back({*section, page.counts});
  }
  return {};
}

template <class List>
void put(List list, const Bands& bands) {
  for (unsigned b = 0; b < kBandCount; ++b) list.set(b, bands[b]);
}

void put_settings(BakeRoot::Builder root, const BakeContents& contents) {
  const BakeSettings& settings = contents.settings;
  root.setSeed(settings.seed);
  root.setPhotons(settings.photons);
  root.setSources(settings.sources);
  root.setRouletteKappa(settings.roulette_exponent);
  root.setLongestPathS(settings.longest_path_s);
  root.setTemperatureC(settings.air.temperature_c);
  root.setHumidityPercent(settings.air.humidity_percent);
  root.setPressureKpa(settings.air.pressure_kpa);
  root.setTool(contents.provenance.tool);
  root.setLevel(contents.provenance.level);
  root.setInputHash(contents.provenance.input_hash);

  const BakeStatistics& statistics = contents.statistics;
  root.setPhotonsTraced(statistics.photons_traced);
  root.setBounces(statistics.bounces);
  root.setPhotonsEscaped(statistics.photons_escaped);
  root.setRooms(statistics.rooms);
  root.setDeposits(statistics.deposits);
  root.setMeanFreePathM(statistics.mean_free_path_m);
  put(root.initPowerEmitted(kBandCount), statistics.power_emitted);
  put(root.initPowerEscaped(kBandCount), statistics.power_escaped);
  put(root.initPowerUnfinished(kBandCount), statistics.power_unfinished);
  const auto& given = contents.provenance.arguments;
  auto arguments = root.initArguments(static_cast<unsigned>(given.size()));
  for (unsigned i = 0; i < arguments.size(); ++i) arguments.set(i, given[i]);
  const Provenance& provenance = contents.provenance;
  auto libraries = root.initLibraries(static_cast<unsigned>(provenance.libraries.size()));
  for (unsigned i = 0; i < libraries.size(); ++i) libraries.set(i, provenance.libraries[i]);
  auto inputs = root.initInputs(static_cast<unsigned>(provenance.inputs.size()));
  for (unsigned i = 0; i < inputs.size(); ++i) {
    inputs[i].setName(provenance.inputs[i].name);
    inputs[i].setBytes(provenance.inputs[i].bytes);
    inputs[i].setHash(provenance.inputs[i].hash);
  }
  root.setDecayPlaces(statistics.decay.places);
  put(root.initDecayT30S(kBandCount), statistics.decay.t30_s);
  put(root.initDecayT30ErrorS(kBandCount), statistics.decay.t30_error_s);
  root.setDecayErrorDb(statistics.decay.error_db);
  auto warnings = root.initWarnings(static_cast<unsigned>(statistics.warnings.size()));
  for (unsigned i = 0; i < warnings.size(); ++i) warnings.set(i, statistics.warnings[i]);
  auto bands_hz = root.initBandsHz(kBandCount);
  for (unsigned b = 0; b < kBandCount; ++b) bands_hz.set(b, static_cast<float>(kBandCentres_hz[b]));
}

void put_signal(::Signal::Builder stored, const Signal& signal, const SignalSections& sections) {
  stored.setName(signal.name);
  stored.setLoop(signal.loop);
  stored.setScale(sections.scale);
  stored.setFrames(signal.samples.size());
  const auto count = static_cast<unsigned>(sections.blocks.size());
  auto offset = stored.initBlockOffset(count), hash = stored.initBlockHash(count);
  auto bytes = stored.initBlockBytes(count);
  for (unsigned i = 0; i < count; ++i) {
    offset.set(i, sections.blocks[i].offset);
    bytes.set(i, static_cast<std::uint32_t>(sections.blocks[i].bytes));
    hash.set(i, sections.blocks[i].hash);
  }
  put(stored.initMeanSquare(kBandCount), sections.mean_square);
  stored.setEnvelopeOffset(sections.envelope.offset);
  stored.setEnvelopeBytes(static_cast<std::uint32_t>(sections.envelope.bytes));
  stored.setEnvelopeHash(sections.envelope.hash);
}

void put_emitter_copies(BakeRoot::Builder root, const std::vector<EmitterInstance>& copies,
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

// Encodes instanced emitters as runs unless their number exceeds the limits of the reader.
void put_emitters(BakeRoot::Builder root, const BakeContents& contents, std::uint64_t file_bytes) {
  const std::vector<Emitter>& table = contents.emitters;
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
    put(emitters[i].initDirectivity(kBandCount), emitter.directivity);
    emitters[i].setSignal(emitter.signal);
    emitters[i].setDelayS(emitter.delay_s);
  }
  if (!copies.empty()) put_emitter_copies(root, copies, names);
}

void put_tables(BakeRoot::Builder root, const BakeContents& contents, const Sections& sections) {
  auto materials = root.initMaterials(static_cast<unsigned>(contents.materials.size()));
  for (unsigned i = 0; i < materials.size(); ++i) {
    const Material& material = contents.materials[i];
    materials[i].setName(material.name);
    put(materials[i].initAbsorption(kBandCount), material.absorption);
    put(materials[i].initScattering(kBandCount), material.scattering);
    put(materials[i].initPhong(kBandCount), material.phong);
    put(materials[i].initTransmission(kBandCount), material.transmission);
  }
  put_emitters(root, contents, sections.bytes_before_root);
  auto signals = root.initSignals(static_cast<unsigned>(contents.signals.size()));
  for (unsigned i = 0; i < signals.size(); ++i)
    put_signal(signals[i], contents.signals[i], sections.signals[i]);
  auto geometry = root.initGeometry();
  geometry.setLowX(sections.geometry_low_m.x);
  geometry.setLowY(sections.geometry_low_m.y);
  geometry.setLowZ(sections.geometry_low_m.z);
  geometry.setOffset(sections.geometry.offset);
  geometry.setHash(sections.geometry.hash);
  auto pages = geometry.initPages(static_cast<unsigned>(sections.geometry_pages.size()));
  for (unsigned i = 0; i < pages.size(); ++i) {
    const StoredGeometryPage& page = sections.geometry_pages[i];
    pages[i].setOffset(page.section.offset);
    pages[i].setHash(page.section.hash);
    pages[i].setBytes(static_cast<std::uint32_t>(page.section.bytes));
    pages[i].setVertices(page.counts.vertices);
    pages[i].setTriangles(page.counts.triangles);
  }
}

void put_trees(BakeRoot::Builder root, const std::vector<WrittenTree>& written,
               const std::vector<std::vector<std::uint32_t>>& signal_maps) {
  auto trees = root.initTrees(static_cast<unsigned>(written.size()));
  for (unsigned t = 0; t < trees.size(); ++t) {
    std::vector<std::byte> top;
    put_entry(written[t].top, top);
    trees[t].setTop(kj::arrayPtr(reinterpret_cast<const kj::byte*>(top.data()), top.size()));
    auto levels = trees[t].initLevels(static_cast<unsigned>(written[t].levels.size()));
    for (unsigned d = 0; d < levels.size(); ++d) {
      const OctreeLevel& level = written[t].levels[d];
      levels[d].setNodes(level.nodes);
      levels[d].setSources(level.sources);
      levels[d].setPackedBytes(level.packed_bytes);
      put(levels[d].initPower(kBandCount), level.power);
    }
  }
  auto maps = root.initSignalMaps(static_cast<unsigned>(signal_maps.size()));
  for (unsigned m = 0; m < maps.size(); ++m) {
    auto map = maps.init(m, static_cast<unsigned>(signal_maps[m].size()));
    for (unsigned i = 0; i < map.size(); ++i) map.set(i, signal_maps[m][i]);
  }
}

Error unreadable(const Error& error) {
  return Error("is not written, since nothing could read it: " + error.message);
}

Result<void> write_all(AtomicFile& file, const std::string& path, const BakeContents& contents) {
  SectionWriter appender(file);
  Sections sections;
  if (const auto room = appender.append(std::vector<std::byte>(sizeof(Preamble))); !room.ok())
    return room.error();
  const PageContext around{{}, contents.signal_maps.size(), contents.emitters.size()};
  OctreeWriter pages(appender, mirror_bits_for(contents.materials), around);
  if (const auto done = write_trees(contents, pages); !done.ok()) return done;
  if (const auto done = write_signals(contents.signals, appender, sections); !done.ok())
    return done;
  if (const auto done = write_geometry(contents.mesh, appender, sections); !done.ok()) return done;
  if (const auto done = appender.align(); !done.ok()) return done;

  sections.bytes_before_root = appender.offset();
  capnp::MallocMessageBuilder message;
  auto root = message.initRoot<BakeRoot>();
  put_settings(root, contents);
  put_tables(root, contents, sections);
  put_trees(root, pages.trees(), contents.signal_maps);
  const auto words = capnp::messageToFlatArray(message);
  const auto chars = words.asBytes();
  const auto bytes_of_root = std::as_bytes(std::span(chars.begin(), chars.size()));
  if (const auto readable = read_bake_root(bytes_of_root, appender.offset()); !readable.ok())
    return unreadable(readable.error()).in(path);
  const auto section = appender.append(bytes_of_root);
  if (!section.ok()) return section.error();

  Preamble preamble;
  preamble.major = kFormatMajor;
  preamble.minor = kFormatMinor;
  preamble.file_bytes = appender.offset();
  preamble.root_offset = section->offset;
  preamble.root_bytes = section->bytes;
  preamble.root_hash = section->hash;
  const auto bytes = std::as_bytes(std::span(&preamble, 1));
  preamble.preamble_hash = hash_of(bytes.first(kHashedPreambleBytes));
  return file.write_at(0, bytes);
}

}  // namespace

Result<void> write_bake(const std::string& path, const BakeContents& contents, int threads) {
  if (const auto sound = check_bake(contents); !sound.ok())
    return unreadable(sound.error()).in(path);
  auto file = AtomicFile::create(path);
  if (!file.ok()) return file.error();
  Result<void> done;
  const int cores = tbb::info::default_concurrency();  // TBB has no more threads than these
  tbb::task_arena arena(threads > 0 ? std::min(threads, cores) : cores);
  arena.execute([&] { done = write_all(*file, path, contents); });
  return done.ok() ? file->commit() : done;
}

std::vector<std::string> file_library_versions() {
  const auto part = [](int number) { return std::to_string(number); };
  constexpr int kVersion = CAPNP_VERSION;  // 1 000 000 major + 1000 minor + micro
  std::vector<std::string> versions = {"Cap'n Proto " + part(kVersion / 1'000'000) + "." +
                                           part(kVersion / 1000 % 1000) + "." +
                                           part(kVersion % 1000),
                                       zstd_version()};
  for (std::string& version : sound_library_versions()) versions.push_back(std::move(version));
  return versions;
}

}  // namespace clamor
