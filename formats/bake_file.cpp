#include "formats/bake_file.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <exception>
#include <limits>

#include <capnp/message.h>
#include <capnp/serialize.h>

#include "formats/audio_file.h"
#include "formats/bake_layout.h"
#include "formats/bake_root.capnp.h"
#include "formats/geometry_section.h"
#include "formats/mapped_file.h"
#include "formats/page.h"

namespace clamor {

namespace {

constexpr const char* kAdvice = "Copy the file again or bake again.";

Error damaged(const std::string& what) { return Error(what + ". " + kAdvice); }

// A stretch of the file, as the root declares it.
struct Section {
  std::uint64_t offset = 0, bytes = 0, hash = 0;
};

struct StoredSignal {
  std::string name;
  bool loop = false;
  float scale = 1;
  std::uint64_t frames = 0;
  Section section;
};

// Far beyond any level (import ends at 1000 km), and near enough that delays fit into 32 bits.
constexpr float kFarthest_m = 2e6f;
constexpr float kMostPower = 1e30f;

template <class List>
bool all_within(const List& list, float least, float most) {
  for (const float value : list)
    if (!(value >= least && value <= most)) return false;
  return true;
}

// Eight values within [least, most], or an Error.
template <class List>
Result<Bands> read_bands(const List& list, float least, float most, const char* what) {
  Bands bands{};
  if (list.size() != kBandCount) return damaged(std::string(what) + " has not eight bands");
  for (unsigned b = 0; b < kBandCount; ++b) {
    bands[b] = list[b];
    if (!(bands[b] >= least && bands[b] <= most))
      return damaged(std::string(what) + " is out of range");
  }
  return bands;
}

std::string text(capnp::Text::Reader reader) { return {reader.begin(), reader.size()}; }

Result<Preamble> read_preamble(std::span<const std::byte> bytes) {
  Preamble preamble;
  if (bytes.size() < kMagic.size() || std::memcmp(bytes.data(), kMagic.data(), 8) != 0)
    return Error("is not a Clamor bake file; name a file that 'clamor bake' wrote");
  if (bytes.size() < sizeof(preamble)) return damaged("is cut short");
  std::memcpy(&preamble, bytes.data(), sizeof(preamble));
  // Before the checksum: another major may lay out and sum these bytes in its own way.
  if (preamble.major != kFormatMajor)
    return Error("format " + std::to_string(preamble.major) + ", but this build reads format " +
                 std::to_string(kFormatMajor) + ". Update the player or bake again.");
  if (preamble.preamble_hash != hash_of(bytes.first(kHashedPreambleBytes)))
    return damaged("its first 64 bytes fail their checksum");
  if (preamble.file_bytes != bytes.size())
    return damaged("is " + std::to_string(bytes.size()) + " bytes long but was written with " +
                   std::to_string(preamble.file_bytes));
  if (preamble.root_offset % 8 != 0 || preamble.root_bytes % 8 != 0 ||
      preamble.root_offset < sizeof(preamble) || preamble.root_offset > bytes.size() ||
      preamble.root_bytes > bytes.size() - preamble.root_offset)
    return damaged("its root lies outside the file");
  if (preamble.root_hash != hash_of(bytes.subspan(preamble.root_offset, preamble.root_bytes)))
    return damaged("its root fails its checksum");
  return preamble;
}

}  // namespace

struct BakeFile::State {
  explicit State(MappedFile mapped) : file(std::move(mapped)) {}

  Result<void> read_root(BakeRoot::Reader root);
  Result<void> read_settings(BakeRoot::Reader root);
  Result<void> read_tables(BakeRoot::Reader root);
  Result<void> read_octree(BakeRoot::Reader root);
  Result<Section> checked(Section section);
  Result<std::span<const std::byte>> verified(const Section& section) const;

  MappedFile file;
  std::string path;
  Preamble preamble;
  BakeSettings settings;
  Provenance provenance;
  BakeStatistics statistics;
  std::vector<Material> materials;
  std::vector<Emitter> emitters;
  std::vector<StoredSignal> signals;
  GeometryCounts geometry_counts;
  Section geometry;
  std::vector<OctreeNode> nodes;
  std::vector<Section> pages;
  std::uint64_t source_count = 0;
  std::uint64_t section_end = sizeof(Preamble);  // sections follow each other without overlap
};

// A section must lie after the one before it and before the root.
Result<Section> BakeFile::State::checked(Section section) {
  if (section.offset < section_end || section.offset > preamble.root_offset ||
      section.bytes > preamble.root_offset - section.offset)
    return damaged("a part of it lies outside the file or over another part");
  section_end = section.offset + section.bytes;
  return section;
}

Result<std::span<const std::byte>> BakeFile::State::verified(const Section& section) const {
  const auto bytes = file.bytes().subspan(section.offset, section.bytes);
  if (hash_of(bytes) != section.hash) return Error("fails its checksum");
  return bytes;
}

Result<void> BakeFile::State::read_settings(BakeRoot::Reader root) {
  settings.seed = root.getSeed();
  settings.photons = root.getPhotons();
  settings.sources = root.getSources();
  settings.roulette_kappa = root.getRouletteKappa();
  settings.longest_path_s = root.getLongestPathS();
  settings.air = {root.getTemperatureC(), root.getHumidityPercent(), root.getPressureKpa()};
  const Air& air = settings.air;
  if (!(air.temperature_c > -100 && air.temperature_c < 1000 && air.humidity_percent >= 0 &&
        air.humidity_percent <= 100 && air.pressure_kpa > 0 && air.pressure_kpa < 1e5) ||
      !std::isfinite(settings.roulette_kappa) || !std::isfinite(settings.longest_path_s))
    return damaged("its settings are out of range");
  provenance = {text(root.getTool()), text(root.getLevel()), root.getInputHash(), {}};

  statistics.photons_traced = root.getPhotonsTraced();
  statistics.bounces = root.getBounces();
  statistics.photons_escaped = root.getPhotonsEscaped();
  statistics.rooms = root.getRooms();
  statistics.deposits = root.getDeposits();
  statistics.mean_free_path_m = root.getMeanFreePathM();
  if (!std::isfinite(statistics.mean_free_path_m)) return damaged("its statistics are no numbers");
  const auto emitted = read_bands(root.getPowerEmitted(), 0, kMostPower, "the emitted power");
  if (!emitted.ok()) return emitted.error();
  const auto escaped = read_bands(root.getPowerEscaped(), 0, kMostPower, "the escaped power");
  if (!escaped.ok()) return escaped.error();
  const auto unfinished =
      read_bands(root.getPowerUnfinished(), 0, kMostPower, "the unfinished power");
  if (!unfinished.ok()) return unfinished.error();
  statistics.power_emitted = *emitted;
  statistics.power_escaped = *escaped;
  statistics.power_unfinished = *unfinished;
  for (const auto word : root.getArguments()) provenance.arguments.push_back(text(word));
  for (const auto warning : root.getWarnings()) statistics.warnings.push_back(text(warning));

  const auto bands_hz = root.getBandsHz();
  if (bands_hz.size() != kBandCount) return damaged("it has not eight bands");
  for (unsigned b = 0; b < kBandCount; ++b)
    if (bands_hz[b] != static_cast<float>(kBandCentres_hz[b]))
      return Error("its bands are not the octaves from 63 Hz to 8 kHz that this build reads");
  return {};
}

Result<void> BakeFile::State::read_tables(BakeRoot::Reader root) {
  for (const auto stored : root.getMaterials()) {
    Material material;
    material.name = text(stored.getName());
    const std::string what = "material " + in_quotes(material.name);
    const auto absorption = read_bands(stored.getAbsorption(), 0, 1, what.c_str());
    const auto scattering = read_bands(stored.getScattering(), 0, 1, what.c_str());
    const auto phong = read_bands(stored.getPhong(), 0, 1000, what.c_str());
    const auto transmission = read_bands(stored.getTransmission(), 0, 1, what.c_str());
    for (const auto* bands : {&absorption, &scattering, &phong, &transmission})
      if (!bands->ok()) return bands->error();
    material.absorption = *absorption;
    material.scattering = *scattering;
    material.phong = *phong;
    material.transmission = *transmission;
    materials.push_back(std::move(material));
  }
  if (materials.size() > 65536) return damaged("it has more materials than can be numbered");

  const auto stored_signals = root.getSignals();
  for (const auto stored : root.getEmitters()) {
    Emitter emitter;
    emitter.name = text(stored.getName());
    emitter.position_m = {stored.getX(), stored.getY(), stored.getZ()};
    emitter.axis = {stored.getAxisX(), stored.getAxisY(), stored.getAxisZ()};
    emitter.gain = stored.getGain();
    emitter.signal = stored.getSignal();
    emitter.delay_s = stored.getDelayS();
    const std::string what = "emitter " + in_quotes(emitter.name);
    const auto directivity = read_bands(stored.getDirectivity(), 0, 1000, what.c_str());
    if (!directivity.ok()) return directivity.error();
    emitter.directivity = *directivity;
    if (!(length(emitter.position_m) <= kFarthest_m) ||
        !(std::abs(length(emitter.axis) - 1) < 1e-3) ||
        !(emitter.gain >= 0 && emitter.gain < 1e10) || !(std::abs(emitter.delay_s) <= 86400) ||
        emitter.signal >= stored_signals.size())
      return damaged(what + " is out of range");
    emitters.push_back(std::move(emitter));
  }
  return {};
}

Result<void> BakeFile::State::read_octree(BakeRoot::Reader root) {
  const auto low = root.getNodeLow(), high = root.getNodeHigh();
  const auto key = root.getNodeHighestKey(), power = root.getNodePower();
  const auto cone = root.getNodeCone(), delay = root.getNodeDelay();
  const auto children = root.getNodeChildren();
  const auto offset = root.getPageOffset();
  const auto packed_bytes = root.getPagePacked(), sources = root.getPageSources();
  const auto hash = root.getPageHash();
  const std::uint64_t count = key.size();
  if (low.size() != 3 * count || high.size() != 3 * count || power.size() != 8 * count ||
      cone.size() != 4 * count || delay.size() != 2 * count || children.size() != 8 * count ||
      offset.size() != count || packed_bytes.size() != count || sources.size() != count ||
      hash.size() != count)
    return damaged("the columns of its node index differ in length");
  constexpr float kLargest = std::numeric_limits<float>::max();
  if (!all_within(low, -kFarthest_m, kFarthest_m) || !all_within(high, -kFarthest_m, kFarthest_m) ||
      !all_within(key, 0, kLargest) || !all_within(power, 0, kMostPower) ||
      !all_within(cone, -1.001f, 1.001f) || !all_within(delay, 0, 86400))
    return damaged("its node index has values out of range");

  nodes.resize(count);
  pages.resize(count);
  std::vector<bool> has_parent(count, false);
  for (unsigned i = 0; i < count; ++i) {
    OctreeNode& node = nodes[i];
    for (unsigned axis = 0; axis < 3; ++axis) {
      node.low_m[static_cast<int>(axis)] = low[3 * i + axis];
      node.high_m[static_cast<int>(axis)] = high[3 * i + axis];
      node.cone_axis[static_cast<int>(axis)] = cone[4 * i + axis];
      if (low[3 * i + axis] > high[3 * i + axis]) return damaged("a node's box is inside out");
    }
    node.cone_cos = cone[4 * i + 3];
    node.highest_key = key[i];
    node.least_delay_s = delay[2 * i];
    node.most_delay_s = delay[2 * i + 1];
    for (unsigned k = 0; k < 8; ++k) {
      node.power[k] = power[8 * i + k];
      const std::uint32_t child = node.children[k] = children[8 * i + k];
      if (child == kNoNode) continue;
      if (child <= i || child >= count || has_parent[child])
        return damaged("its node index is no tree");
      has_parent[child] = true;
    }
    if (i > 0 && !has_parent[i]) return damaged("its node index is no tree");
    node.source_count = sources[i];
    node.first_source = source_count;
    if (node.source_count == 0 || node.source_count > kNodeSources)
      return damaged("a page declares " + std::to_string(node.source_count) + " sources");
    source_count += node.source_count;
    const auto section = checked({offset[i], packed_bytes[i], hash[i]});
    if (!section.ok()) return section.error();
    pages[i] = *section;
  }
  return {};
}

Result<void> BakeFile::State::read_root(BakeRoot::Reader root) {
  if (const auto done = read_settings(root); !done.ok()) return done;
  if (const auto done = read_tables(root); !done.ok()) return done;
  if (const auto done = read_octree(root); !done.ok()) return done;

  // In the order of the file: pages, signals, geometry.
  constexpr std::uint64_t kLongest_frames = std::uint64_t{kSampleRate_hz} * 1800;
  for (const auto stored : root.getSignals()) {
    StoredSignal signal{
        text(stored.getName()), stored.getLoop(), stored.getScale(), stored.getFrames(), {}};
    const auto section = checked({stored.getOffset(), stored.getBytes(), stored.getHash()});
    if (!section.ok()) return section.error();
    signal.section = *section;
    if (!(signal.scale > 0 && signal.scale < 1e6f) || signal.frames == 0 ||
        signal.frames > kLongest_frames)
      return damaged("signal " + in_quotes(signal.name) + " is out of range");
    signals.push_back(std::move(signal));
  }
  const auto stored = root.getGeometry();
  geometry_counts = {{stored.getLowX(), stored.getLowY(), stored.getLowZ()},
                     stored.getVertices(),
                     stored.getTriangles()};
  if (!(length(geometry_counts.low_m) <= 2 * kFarthest_m))
    return damaged("its geometry is nowhere");
  const auto section = checked({stored.getOffset(), stored.getBytes(), stored.getHash()});
  if (!section.ok()) return section.error();
  geometry = *section;
  return {};
}

BakeFile::BakeFile(std::unique_ptr<State> state) : state_(std::move(state)) {}
BakeFile::BakeFile(BakeFile&&) noexcept = default;
BakeFile& BakeFile::operator=(BakeFile&&) noexcept = default;
BakeFile::~BakeFile() = default;

Result<BakeFile> BakeFile::open(const std::string& path) {
  auto mapped = MappedFile::open(path);
  if (!mapped.ok()) return mapped.error();
  auto state = std::make_unique<State>(std::move(*mapped));
  state->path = path;
  const auto bytes = state->file.bytes();
  const auto preamble = read_preamble(bytes);
  if (!preamble.ok()) return preamble.error().in(path);
  state->preamble = *preamble;

  const auto root_bytes = bytes.subspan(preamble->root_offset, preamble->root_bytes);
  capnp::ReaderOptions options;
  options.traversalLimitInWords = std::max<std::uint64_t>(1024, 4 * (preamble->root_bytes / 8));
  options.nestingLimit = 16;
  try {
    capnp::FlatArrayMessageReader message(
        kj::arrayPtr(reinterpret_cast<const capnp::word*>(root_bytes.data()),
                     root_bytes.size() / sizeof(capnp::word)),
        options);
    if (const auto done = state->read_root(message.getRoot<BakeRoot>()); !done.ok())
      return done.error().in(path);
  } catch (const std::exception&) {
    // Cap'n Proto's own words name its source files, not the user's.
    return damaged("its root is not a Cap'n Proto message of this format").in(path);
  }
  return BakeFile(std::move(state));
}

const std::string& BakeFile::path() const { return state_->path; }
std::uint16_t BakeFile::major() const { return state_->preamble.major; }
std::uint16_t BakeFile::minor() const { return state_->preamble.minor; }
const BakeSettings& BakeFile::settings() const { return state_->settings; }
const Provenance& BakeFile::provenance() const { return state_->provenance; }
const BakeStatistics& BakeFile::statistics() const { return state_->statistics; }
const std::vector<Material>& BakeFile::materials() const { return state_->materials; }
const std::vector<Emitter>& BakeFile::emitters() const { return state_->emitters; }
const std::vector<OctreeNode>& BakeFile::nodes() const { return state_->nodes; }
std::uint64_t BakeFile::source_count() const { return state_->source_count; }
std::size_t BakeFile::page_count() const { return state_->pages.size(); }
std::size_t BakeFile::signal_count() const { return state_->signals.size(); }

BakeBytes BakeFile::bytes() const {
  BakeBytes bytes;
  bytes.file = state_->preamble.file_bytes;
  bytes.root = state_->preamble.root_bytes;
  for (std::size_t i = 0; i < state_->pages.size(); ++i) {
    bytes.pages += state_->pages[i].bytes;
    bytes.pages_unpacked += page_bytes(state_->nodes[i].source_count);
  }
  for (const StoredSignal& signal : state_->signals) bytes.signals += signal.section.bytes;
  bytes.geometry = state_->geometry.bytes;
  return bytes;
}

PageInfo BakeFile::page(std::size_t index) const {
  const std::uint32_t sources = state_->nodes[index].source_count;
  return {state_->pages[index].offset, static_cast<std::uint32_t>(state_->pages[index].bytes),
          static_cast<std::uint32_t>(page_bytes(sources)), sources};
}

Result<std::vector<Source>> BakeFile::read_page(std::size_t index) const {
  const OctreeNode& node = state_->nodes[index];
  const auto failed = [&](const Error& error) {
    return damaged(state_->path + ": page " + std::to_string(index + 1) + " of " +
                   std::to_string(page_count()) + " (" +
                   std::to_string(state_->pages[index].bytes) + " bytes at " +
                   std::to_string(state_->pages[index].offset) + ") " + error.message);
  };
  const auto frame = state_->verified(state_->pages[index]);
  if (!frame.ok()) return failed(frame.error());
  const auto bytes = unpacked(*frame, page_bytes(node.source_count));
  if (!bytes.ok()) return failed(bytes.error());
  auto sources = decode_page(node, *bytes, state_->emitters, state_->materials.size());
  if (!sources.ok()) return failed(sources.error());
  return sources;
}

Result<std::vector<Source>> BakeFile::read_all_sources() const {
  std::vector<Source> all;
  for (std::size_t i = 0; i < page_count(); ++i) {
    const auto page = read_page(i);
    if (!page.ok()) return page.error();
    all.insert(all.end(), page->begin(), page->end());
  }
  return all;
}

Result<Signal> BakeFile::read_signal(std::size_t index) const {
  const StoredSignal& stored = state_->signals[index];
  const std::string where = state_->path + ": signal " + in_quotes(stored.name);
  const auto flac = state_->verified(stored.section);
  if (!flac.ok()) return damaged(where + " " + flac.error().message);
  auto samples = decode_audio(*flac, stored.name);
  if (!samples.ok()) return samples.error().in(state_->path);
  if (samples->size() != stored.frames) return damaged(where + " has the wrong length");
  for (float& sample : *samples) sample *= stored.scale;
  return Signal{stored.name, std::move(*samples), stored.loop};
}

Result<Mesh> BakeFile::read_mesh() const {
  const auto frame = state_->verified(state_->geometry);
  if (!frame.ok()) return damaged(state_->path + ": the geometry " + frame.error().message);
  auto mesh = unpack_geometry(*frame, state_->geometry_counts, state_->materials.size());
  if (!mesh.ok()) return damaged(state_->path + ": " + mesh.error().message);
  return mesh;
}

}  // namespace clamor
