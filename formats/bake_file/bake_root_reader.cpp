#include "formats/bake_file/bake_root_reader.h"

#include <algorithm>
#include <cmath>
#include <exception>
#include <limits>
#include <new>

#include <capnp/message.h>
#include <capnp/serialize.h>

#include "formats/bake_file/bake_layout.h"
#include "formats/bake_file/bake_root.capnp.h"
#include "formats/bake_file/bake_root_emitters.h"
#include "formats/bake_file/bake_root_findings.h"
#include "formats/bake_file/bake_root_images.h"
#include "formats/bake_file/bake_root_portals.h"
#include "formats/bake_file/bake_root_values.h"
#include "formats/bake_file/signal_section.h"
#include "formats/bake_file/value_limits.h"

namespace clamor {

namespace {

using bake_root::name;
using bake_root::read_bands;
using bake_root::text;

// Limit of nodes and sources per level, far beyond any file.
constexpr std::uint64_t kMaxCounted = 1ULL << 48;

class RootReader {
 public:
  RootReader(BakeRoot::Reader root, std::uint64_t end) : root_(root), end_(end) {}

  Result<BakeRootContents> read();

 private:
  Result<void> read_settings();
  Result<void> read_provenance();
  Result<void> read_statistics();
  Result<void> read_materials();
  Result<void> read_movables();
  Result<void> read_emitters();
  Result<void> read_portals();
  Result<void> read_images();
  Result<StoredTree> read_tree(::Tree::Reader stored);
  Result<void> read_trees();
  Result<StoredTree> read_probe_tree(::Tree::Reader stored);
  Result<void> read_probes();
  Result<void> read_signal_maps();
  Result<void> read_signals();
  Result<void> read_blocks(::Signal::Reader stored, StoredSignal& signal);
  Result<void> read_geometry();
  Result<FileSection> checked(FileSection section);

  BakeRoot::Reader root_;
  std::uint64_t end_;
  std::uint64_t section_end_ = kFirstPageOffset;  // sections are in order and do not overlap
  BakeRootContents contents_;
};

// A section must lie between the previous section and the root.
Result<FileSection> RootReader::checked(FileSection section) {
  if (section.offset < section_end_ || section.offset > end_ ||
      section.bytes > end_ - section.offset)
    return Error("a section lies outside the file or overlaps another");
  section_end_ = section.offset + section.bytes;
  return section;
}

Result<void> RootReader::read_settings() {
  BakeSettings& settings = contents_.settings;
  settings.seed = root_.getSeed();
  settings.photons = root_.getPhotons();
  settings.sources = root_.getSources();
  settings.roulette_exponent = root_.getRouletteKappa();
  settings.longest_path_s = root_.getLongestPathS();
  settings.early_order = root_.getEarlyOrder();
  settings.air = {root_.getTemperatureC(), root_.getHumidityPercent(), root_.getPressureKpa()};
  const Air& air = settings.air;
  if (!(air.temperature_c > -100 && air.temperature_c < 1000 && air.humidity_percent >= 0 &&
        air.humidity_percent <= 100 && air.pressure_kpa > 0 && air.pressure_kpa < 1e5) ||
      settings.early_order > kMaxImageOrder || !std::isfinite(settings.roulette_exponent) ||
      !std::isfinite(settings.longest_path_s))
    return Error("its settings are out of range");

  const auto bands_hz = root_.getBandsHz();
  if (bands_hz.size() != kBandCount) return Error("it has not eight bands");
  for (unsigned b = 0; b < kBandCount; ++b)
    if (bands_hz[b] != static_cast<float>(kBandCentres_hz[b]))
      return Error("its bands are not the octaves from 63 Hz to 8 kHz that this build reads");
  return {};
}

Result<void> RootReader::read_provenance() {
  Provenance& provenance = contents_.provenance;
  provenance.tool = text(root_.getTool());
  provenance.level = text(root_.getLevel());
  provenance.input_hash = root_.getInputHash();
  for (const auto word : root_.getArguments()) provenance.arguments.push_back(text(word));
  for (const auto library : root_.getLibraries()) provenance.libraries.push_back(text(library));
  for (const auto input : root_.getInputs())
    provenance.inputs.push_back({text(input.getName()), input.getBytes(), input.getHash()});
  return {};
}

Result<void> RootReader::read_statistics() {
  BakeStatistics& statistics = contents_.statistics;
  statistics.photons_traced = root_.getPhotonsTraced();
  statistics.bounces = root_.getBounces();
  statistics.photons_escaped = root_.getPhotonsEscaped();
  statistics.rooms = root_.getRooms();
  statistics.deposits = root_.getDeposits();
  statistics.mean_free_path_m = root_.getMeanFreePathM();
  if (!std::isfinite(statistics.mean_free_path_m)) return Error("its statistics are no numbers");
  const auto emitted = read_bands(root_.getPowerEmitted(), 0, kMaxPowerInFile, "the emitted power");
  if (!emitted.ok()) return emitted.error();
  const auto escaped = read_bands(root_.getPowerEscaped(), 0, kMaxPowerInFile, "the escaped power");
  if (!escaped.ok()) return escaped.error();
  const auto unfinished =
      read_bands(root_.getPowerUnfinished(), 0, kMaxPowerInFile, "the unfinished power");
  if (!unfinished.ok()) return unfinished.error();
  statistics.power_emitted = *emitted;
  statistics.power_escaped = *escaped;
  statistics.power_unfinished = *unfinished;
  for (const auto stored : root_.getPowerArrived()) {
    const auto arrived = read_bands(stored, 0, kMaxPowerInFile, "the power that arrived");
    if (!arrived.ok()) return arrived.error();
    statistics.power_arrived.push_back(*arrived);
  }
  if (statistics.power_arrived.size() > root_.getMaterials().size())
    return Error("power arrived at more materials than there are");
  for (const auto warning : root_.getWarnings()) statistics.warnings.push_back(text(warning));
  auto findings = read_findings(root_);
  if (!findings.ok()) return findings.error();
  statistics.findings = std::move(*findings);

  DecaySummary& decay = statistics.decay;
  decay.places = root_.getDecayPlaces();
  decay.error_db = root_.getDecayErrorDb();
  if (!(decay.error_db >= 0 && decay.error_db < 1e6f)) return Error("its decay is out of range");
  const auto t30_s = read_bands(root_.getDecayT30S(), 0, 1e6f, "the decay time");
  if (!t30_s.ok()) return t30_s.error();
  const auto error_s = read_bands(root_.getDecayT30ErrorS(), 0, 1e6f, "the decay time's error");
  if (!error_s.ok()) return error_s.error();
  decay.t30_s = *t30_s;
  decay.t30_error_s = *error_s;
  return {};
}

Result<void> RootReader::read_materials() {
  for (const auto stored : root_.getMaterials()) {
    Material material;
    material.name = name(stored.getName());
    const std::string what = "material " + in_quotes(material.name);
    const auto absorption = read_bands(stored.getAbsorption(), 0, 1, what);
    const auto scattering = read_bands(stored.getScattering(), 0, 1, what);
    const auto phong = read_bands(stored.getPhong(), 0, kMirrorExponent, what);
    const auto transmission = read_bands(stored.getTransmission(), 0, 1, what);
    for (const auto* bands : {&absorption, &scattering, &phong, &transmission})
      if (!bands->ok()) return bands->error();
    material.absorption = *absorption;
    material.scattering = *scattering;
    material.phong = *phong;
    // Files of older versions may contain larger values, which the runtime must not use.
    for (std::size_t b = 0; b < kBandCount; ++b)
      material.transmission[b] = std::min((*transmission)[b], material.absorption[b]);
    material.rows_m = stored.getRowsM();
    if (!(material.rows_m >= 0 && static_cast<double>(material.rows_m) <= kDeepestRows_m))
      return Error(what + " has rows of seats that are out of range");
    contents_.materials.push_back(std::move(material));
  }
  if (contents_.materials.size() > 65536) return Error("it has more than 65536 materials");
  return {};
}

Result<void> RootReader::read_movables() {
  const auto movables = root_.getMovables();
  if (movables.size() > kMaxMovableParts) return Error("it has too many movable parts");
  for (const auto stored : movables) {
    MovablePart& part = contents_.movable_parts.emplace_back();
    part.name = name(stored.getName());
    part.rest_pose.position_m = {stored.getX(), stored.getY(), stored.getZ()};
    part.rest_pose.rotation = Rotation(stored.getRotationW(), stored.getRotationX(),
                                       stored.getRotationY(), stored.getRotationZ());
    part.rest_pose.scale = static_cast<double>(stored.getScale());
    const auto vertices = stored.getVertices();
    const auto corners = stored.getTriangles();
    if (vertices.size() % 3 != 0 || corners.size() % 3 != 0 || vertices.size() > 3 * corners.size())
      return Error("movable part " + in_quotes(part.name) + " has lists that do not fit");
    for (unsigned i = 0; i < vertices.size(); i += 3)
      part.mesh.vertices_m.emplace_back(vertices[i], vertices[i + 1], vertices[i + 2]);
    for (unsigned i = 0; i < corners.size(); i += 3)
      part.mesh.triangles.push_back({corners[i], corners[i + 1], corners[i + 2]});
    for (const std::uint16_t material : stored.getMaterials())
      part.mesh.materials.push_back(material);
  }
  return check_movable_parts(contents_.movable_parts, contents_.materials.size());
}

Result<void> RootReader::read_emitters() {
  auto emitters = read_emitter_table(root_, contents_.signal_maps, end_);
  if (!emitters.ok()) return emitters.error();
  contents_.emitters = std::move(*emitters);
  return {};
}

Result<void> RootReader::read_images() {
  auto images = clamor::read_images(root_, contents_.emitters.size());
  if (!images.ok()) return images.error();
  contents_.images = std::move(*images);
  return {};
}

Result<void> RootReader::read_portals() {
  auto portals =
      clamor::read_portals(root_, contents_.emitters.size(), contents_.movable_parts.size());
  if (!portals.ok()) return portals.error();
  contents_.portals = std::move(*portals);
  return {};
}

Result<StoredTree> RootReader::read_tree(::Tree::Reader stored) {
  StoredTree tree;
  const auto top = stored.getTop();
  const auto entry = read_entry(
      std::as_bytes(std::span(reinterpret_cast<const std::uint8_t*>(top.begin()), top.size())));
  if (!entry.ok()) return Error("the top of a tree " + entry.error().message);
  // The pages of a tree end with its root, so roots are in file order.
  if (const auto good = check_entry(*entry, section_end_, end_); !good.ok())
    return Error("the top of a tree " + good.error().message);
  section_end_ = entry->page.end();
  tree.top = *entry;

  const auto stored_levels = stored.getLevels();
  if (stored_levels.size() == 0 || stored_levels.size() > kMaxTreeLevels)
    return Error("a tree has " + std::to_string(stored_levels.size()) + " levels");
  for (const auto level : stored_levels) {
    const auto power = read_bands(level.getPower(), 0, kMaxPowerInFile, "the power of a level");
    if (!power.ok()) return power.error();
    tree.depths.push_back({level.getNodes(), level.getSources(), level.getPackedBytes(), *power});
    if (level.getNodes() > kMaxCounted || level.getSources() > kMaxCounted ||
        level.getPackedBytes() > end_)
      return Error("a level of a tree claims more than the file can hold");
  }
  return tree;
}

Result<void> RootReader::read_trees() {
  const auto stored_trees = root_.getTrees();
  if (stored_trees.size() > kMaxTrees) return Error("it has too many trees");
  for (const auto stored : stored_trees) {
    auto tree = read_tree(stored);
    if (!tree.ok()) return tree.error();
    contents_.trees.push_back(tree->top);
    contents_.depths.push_back(std::move(tree->depths));
  }
  return {};
}

Result<StoredTree> RootReader::read_probe_tree(::Tree::Reader stored) {
  auto tree = read_tree(stored);
  if (!tree.ok()) return tree;
  tree->top.of_probe = true;
  if (tree->top.page.instances > 0) return Error("the tree of a probe has instances");
  return tree;
}

// The file has the trees of the places first.
Result<void> RootReader::read_probes() {
  const auto places = root_.getProbes().getPlaces();
  const auto zones = root_.getProbes().getZones();
  if (places.size() > kMaxProbes || zones.size() > places.size())
    return Error("it has too many probes");
  for (const auto stored : places) {
    StoredProbe& probe = contents_.probes.places.emplace_back();
    probe.position_m = {stored.getX(), stored.getY(), stored.getZ()};
    for (int axis = 0; axis < 3; ++axis)
      if (!(std::abs(probe.position_m[axis]) <= kMaxCoordinateInFile_m))
        return Error("a probe lies outside the coordinate range");
    probe.zone = stored.getZone();
    if (probe.zone >= zones.size()) return Error("a probe names a zone that does not exist");
    auto tree = read_probe_tree(stored.getTree());
    if (!tree.ok()) return tree.error();
    probe.tree = std::move(*tree);
  }
  for (const auto stored : zones) {
    auto tree = read_probe_tree(stored);
    if (!tree.ok()) return tree.error();
    tree->top.of_zone = true;
    contents_.probes.zones.push_back(std::move(*tree));
  }
  return {};
}

Result<void> RootReader::read_signal_maps() {
  const auto stored_maps = root_.getSignalMaps();
  const auto signals = root_.getSignals().size();
  if (stored_maps.size() > kMaxSignalMaps) return Error("it has too many signal maps");
  for (const auto stored : stored_maps) {
    auto& map = contents_.signal_maps.emplace_back();
    for (const std::uint32_t signal : stored) map.push_back(signal);
    if (map.size() != signals ||
        std::any_of(map.begin(), map.end(), [&](std::uint32_t s) { return s >= signals; }))
      return Error("a signal map does not fit the signals");
  }
  return {};
}

Result<void> RootReader::read_signals() {
  constexpr std::uint64_t kMaxSignal_frames = std::uint64_t{kSampleRate_hz} * 1800;
  const auto stored_signals = root_.getSignals();
  if (stored_signals.size() > kMaxSignals)
    return Error("it has " + std::to_string(stored_signals.size()) + " signals, more than " +
                 std::to_string(kMaxSignals));
  for (const auto stored : stored_signals) {
    StoredSignal signal{name(stored.getName()),
                        stored.getLoop(),
                        stored.getScale(),
                        stored.getFrames(),
                        {},
                        {},
                        {}};
    const std::string what = "signal " + in_quotes(signal.name);
    if (!(signal.scale > 0 && signal.scale < 1e6f) || signal.frames == 0 ||
        signal.frames > kMaxSignal_frames)
      return Error(what + " is out of range");
    if (const auto done = read_blocks(stored, signal); !done.ok()) return done;
    const auto mean_square = read_bands(stored.getMeanSquare(), 0, kMaxPowerInFile, what);
    if (!mean_square.ok()) return mean_square.error();
    signal.mean_square = *mean_square;
    const auto envelope =
        checked({stored.getEnvelopeOffset(), stored.getEnvelopeBytes(), stored.getEnvelopeHash()});
    if (!envelope.ok()) return envelope.error();
    signal.envelope = *envelope;
    contents_.signals.push_back(std::move(signal));
  }
  return {};
}

Result<void> RootReader::read_blocks(::Signal::Reader stored, StoredSignal& signal) {
  const auto offset = stored.getBlockOffset(), hash = stored.getBlockHash();
  const auto bytes = stored.getBlockBytes();
  const std::size_t count = signal_blocks(signal.frames);
  if (offset.size() != count || bytes.size() != count || hash.size() != count)
    return Error("signal " + in_quotes(signal.name) + " has not " + std::to_string(count) +
                 " blocks");
  for (unsigned i = 0; i < count; ++i) {
    const auto section = checked({offset[i], bytes[i], hash[i]});
    if (!section.ok()) return section.error();
    if (signal_block(signal.frames, i).frames > kMaxFramesPerByte * section->bytes)
      return Error("signal " + in_quotes(signal.name) + " is out of range");
    signal.blocks.push_back(*section);
  }
  return {};
}

Result<void> RootReader::read_geometry() {
  const auto stored = root_.getGeometry();
  contents_.geometry_low_m = {stored.getLowX(), stored.getLowY(), stored.getLowZ()};
  if (!(length(contents_.geometry_low_m) <= 2 * kMaxCoordinateInFile_m))
    return Error("its geometry lies outside the coordinate range");
  const auto whole = checked({stored.getOffset(), stored.getBytes(), stored.getHash()});
  if (!whole.ok()) return whole.error();
  const GeometryCounts counts{stored.getVertices(), stored.getTriangles()};
  const auto pages = stored.getPages();
  if (counts.triangles > 0) {
    if (pages.size() > 0) return Error("its geometry is stored in two formats");
    contents_.geometry.push_back({*whole, counts, true});
    return {};
  }
  if (counts.vertices > 0 || whole->bytes > 0) return Error("its geometry has no triangles");
  std::uint64_t vertices = 0;
  for (const auto page : pages) {
    const auto section = checked({page.getOffset(), page.getBytes(), page.getHash()});
    if (!section.ok()) return section.error();
    contents_.geometry.push_back({*section, {page.getVertices(), page.getTriangles()}});
    const StoredGeometryPage& kept = contents_.geometry.back();
    if (!is_geometry_page(kept.counts, section->bytes))
      return Error("page " + std::to_string(contents_.geometry.size()) +
                   " of its geometry claims more than it can hold");
    vertices += kept.counts.vertices;
  }
  if (vertices > std::numeric_limits<std::uint32_t>::max())
    return Error("its geometry has too many vertices");
  return {};
}

Result<BakeRootContents> RootReader::read() {
  // Sections are checked in file order: pages, signals, geometry.
  for (const auto part :
       {&RootReader::read_settings, &RootReader::read_provenance, &RootReader::read_statistics,
        &RootReader::read_materials, &RootReader::read_movables, &RootReader::read_signal_maps,
        &RootReader::read_emitters, &RootReader::read_portals, &RootReader::read_images,
        &RootReader::read_trees, &RootReader::read_probes, &RootReader::read_signals,
        &RootReader::read_geometry})
    if (const auto done = (this->*part)(); !done.ok()) return done.error();
  return std::move(contents_);
}

}  // namespace

Result<BakeRootContents> read_bake_root(std::span<const std::byte> message, std::uint64_t end) {
  capnp::ReaderOptions options;
  options.traversalLimitInWords = std::max<std::uint64_t>(1024, 4 * (message.size() / 8));
  options.nestingLimit = 16;
  try {
    capnp::FlatArrayMessageReader reader(
        kj::arrayPtr(reinterpret_cast<const capnp::word*>(message.data()),
                     message.size() / sizeof(capnp::word)),
        options);
    return RootReader(reader.getRoot<BakeRoot>(), end).read();
  } catch (const std::bad_alloc&) {
    throw;  // not a fault of the file
  } catch (const std::exception&) {
    // Messages of Cap'n Proto name its own source files.
    return Error("its root is not a Cap'n Proto message of this format");
  }
}

}  // namespace clamor
