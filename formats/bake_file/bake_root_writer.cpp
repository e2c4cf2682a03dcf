#include "formats/bake_file/bake_root_writer.h"

#include <algorithm>
#include <span>
#include <utility>

#include <capnp/message.h>
#include <capnp/orphan.h>
#include <capnp/serialize.h>

#include "formats/bake_file/bake_contents.h"
#include "formats/bake_file/bake_root.capnp.h"
#include "formats/bake_file/bake_root_emitters.h"
#include "formats/bake_file/bake_root_findings.h"
#include "formats/bake_file/bake_root_images.h"
#include "formats/bake_file/bake_root_portals.h"
#include "formats/bake_file/bake_root_values.h"

namespace clamor {

namespace {

using bake_root::write_bands;

void write_settings(BakeRoot::Builder root, const BakeContents& contents) {
  const BakeSettings& settings = contents.settings;
  root.setSeed(settings.seed);
  root.setPhotons(settings.photons);
  root.setSources(settings.sources);
  root.setRouletteKappa(settings.roulette_exponent);
  root.setLongestPathS(settings.longest_path_s);
  root.setEarlyOrder(static_cast<std::uint8_t>(std::max(settings.early_order, 0)));
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
  write_bands(root.initPowerEmitted(kBandCount), statistics.power_emitted);
  write_bands(root.initPowerEscaped(kBandCount), statistics.power_escaped);
  write_bands(root.initPowerUnfinished(kBandCount), statistics.power_unfinished);
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
  write_bands(root.initDecayT30S(kBandCount), statistics.decay.t30_s);
  write_bands(root.initDecayT30ErrorS(kBandCount), statistics.decay.t30_error_s);
  root.setDecayErrorDb(statistics.decay.error_db);
  auto arrived = root.initPowerArrived(static_cast<unsigned>(statistics.power_arrived.size()));
  for (unsigned m = 0; m < arrived.size(); ++m)
    write_bands(arrived.init(m, kBandCount), statistics.power_arrived[m]);
  auto warnings = root.initWarnings(static_cast<unsigned>(statistics.warnings.size()));
  for (unsigned i = 0; i < warnings.size(); ++i) warnings.set(i, statistics.warnings[i]);
  write_findings(root, statistics.findings);
  auto bands_hz = root.initBandsHz(kBandCount);
  for (unsigned b = 0; b < kBandCount; ++b) bands_hz.set(b, static_cast<float>(kBandCentres_hz[b]));
}

void write_signal(::Signal::Builder stored, const Signal& signal, const SignalSections& sections) {
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
  write_bands(stored.initMeanSquare(kBandCount), sections.mean_square);
  stored.setEnvelopeOffset(sections.envelope.offset);
  stored.setEnvelopeBytes(static_cast<std::uint32_t>(sections.envelope.bytes));
  stored.setEnvelopeHash(sections.envelope.hash);
}

template <class List>
void write_surfaces(List list, std::span<const Material> materials) {
  for (unsigned i = 0; i < list.size(); ++i) {
    const Material& material = materials[i];
    list[i].setName(material.name);
    write_bands(list[i].initAbsorption(kBandCount), material.absorption);
    write_bands(list[i].initScattering(kBandCount), material.scattering);
    write_bands(list[i].initPhong(kBandCount), material.phong);
    write_bands(list[i].initTransmission(kBandCount), material.transmission);
  }
}

// A list of elements without a data section, where no material has rows: such files have the bytes
// that they had before there were rows.
void write_materials(BakeRoot::Builder root, std::span<const Material> materials) {
  const auto count = static_cast<unsigned>(materials.size());
  if (std::ranges::none_of(materials, [](const Material& one) { return one.rows_m > 0; })) {
    auto plain =
        capnp::Orphanage::getForMessageContaining(root).newOrphan<capnp::List<PlainMaterial>>(
            count);
    write_surfaces(plain.get(), materials);
    capnp::Orphan<capnp::AnyPointer> list = std::move(plain);
    root.adoptMaterials(list.releaseAs<capnp::List<::Material>>());
    return;
  }
  auto list = root.initMaterials(count);
  write_surfaces(list, materials);
  for (unsigned i = 0; i < count; ++i) list[i].setRowsM(materials[i].rows_m);
}

void write_tables(BakeRoot::Builder root, const BakeContents& contents,
                  const BakeSections& sections) {
  write_materials(root, contents.materials);
  write_emitter_table(root, contents, sections.bytes_before_root);
  auto signals = root.initSignals(static_cast<unsigned>(contents.signals.size()));
  for (unsigned i = 0; i < signals.size(); ++i)
    write_signal(signals[i], contents.signals[i], sections.signals[i]);
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

void write_tree(::Tree::Builder tree, const WrittenTree& written) {
  std::vector<std::byte> top;
  put_entry(written.top, top);
  tree.setTop(kj::arrayPtr(reinterpret_cast<const kj::byte*>(top.data()), top.size()));
  auto depths = tree.initLevels(static_cast<unsigned>(written.depths.size()));
  for (unsigned d = 0; d < depths.size(); ++d) {
    const OctreeDepth& depth = written.depths[d];
    depths[d].setNodes(depth.nodes);
    depths[d].setSources(depth.sources);
    depths[d].setPackedBytes(depth.packed_bytes);
    write_bands(depths[d].initPower(kBandCount), depth.power);
  }
}

// `written` has the trees of the places, then those of the zones.
void write_probes(BakeRoot::Builder root, const BakedProbes& probes,
                  std::span<const WrittenTree> written) {
  if (written.empty()) return;
  const auto count = static_cast<unsigned>(probes.places.size());
  auto places = root.initProbes().initPlaces(count);
  for (unsigned p = 0; p < count; ++p) {
    places[p].setX(probes.places[p].position_m.x);
    places[p].setY(probes.places[p].position_m.y);
    places[p].setZ(probes.places[p].position_m.z);
    places[p].setZone(probes.places[p].zone);
    write_tree(places[p].initTree(), written[p]);
  }
  auto zones = root.getProbes().initZones(static_cast<unsigned>(probes.zones.size()));
  for (unsigned z = 0; z < zones.size(); ++z) write_tree(zones[z], written[count + z]);
}

void write_movables(BakeRoot::Builder root, const std::vector<MovablePart>& parts) {
  auto movables = root.initMovables(static_cast<unsigned>(parts.size()));
  for (unsigned i = 0; i < movables.size(); ++i) {
    auto stored = movables[i];
    const auto& [name, mesh, pose] = parts[i];
    stored.setName(name);
    stored.setX(pose.position_m.x);
    stored.setY(pose.position_m.y);
    stored.setZ(pose.position_m.z);
    stored.setRotationX(pose.rotation.x);
    stored.setRotationY(pose.rotation.y);
    stored.setRotationZ(pose.rotation.z);
    stored.setRotationW(pose.rotation.w);
    stored.setScale(static_cast<float>(pose.scale));
    auto vertices = stored.initVertices(static_cast<unsigned>(3 * mesh.vertices_m.size()));
    for (unsigned v = 0; v < vertices.size(); ++v)
      vertices.set(v, mesh.vertices_m[v / 3][static_cast<glm::length_t>(v % 3)]);
    auto corners = stored.initTriangles(static_cast<unsigned>(3 * mesh.triangles.size()));
    for (unsigned c = 0; c < corners.size(); ++c) corners.set(c, mesh.triangles[c / 3][c % 3]);
    auto materials = stored.initMaterials(static_cast<unsigned>(mesh.materials.size()));
    for (unsigned t = 0; t < materials.size(); ++t) materials.set(t, mesh.materials[t]);
  }
}

void write_trees(BakeRoot::Builder root, std::span<const WrittenTree> written,
                 const std::vector<std::vector<std::uint32_t>>& signal_maps) {
  auto trees = root.initTrees(static_cast<unsigned>(written.size()));
  for (unsigned t = 0; t < trees.size(); ++t) write_tree(trees[t], written[t]);
  auto maps = root.initSignalMaps(static_cast<unsigned>(signal_maps.size()));
  for (unsigned m = 0; m < maps.size(); ++m) {
    auto map = maps.init(m, static_cast<unsigned>(signal_maps[m].size()));
    for (unsigned i = 0; i < map.size(); ++i) map.set(i, signal_maps[m][i]);
  }
}

}  // namespace

std::vector<std::byte> encode_bake_root(const BakeContents& contents, const BakeSections& sections,
                                        std::span<const WrittenTree> trees,
                                        std::span<const WrittenTree> probe_trees) {
  capnp::MallocMessageBuilder message;
  auto root = message.initRoot<BakeRoot>();
  write_settings(root, contents);
  write_tables(root, contents, sections);
  write_movables(root, contents.movable_parts);
  write_trees(root, trees, contents.signal_maps);
  write_probes(root, contents.probes, probe_trees);
  write_portals(root, contents.portals);
  write_images(root, contents.images);
  const auto words = capnp::messageToFlatArray(message);
  const auto chars = words.asBytes();
  const auto bytes = std::as_bytes(std::span(chars.begin(), chars.size()));
  return {bytes.begin(), bytes.end()};
}

std::string root_library_version() {
  constexpr int kVersion = CAPNP_VERSION;  // 1 000 000 major + 1000 minor + micro
  return "Cap'n Proto " + std::to_string(kVersion / 1'000'000) + "." +
         std::to_string(kVersion / 1000 % 1000) + "." + std::to_string(kVersion % 1000);
}

}  // namespace clamor
