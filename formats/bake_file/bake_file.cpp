#include "formats/bake_file/bake_file.h"

#include <algorithm>
#include <cstring>

#include "common/material.h"
#include "common/object_pool.h"
#include "common/shared_while_used.h"
#include "formats/bake_file/bake_layout.h"
#include "formats/bake_file/bake_metadata.h"
#include "formats/bake_file/bake_root_reader.h"
#include "formats/bake_file/first_leg.h"
#include "formats/bake_file/geometry_section.h"
#include "formats/bake_file/page.h"
#include "formats/bake_file/page_parents.h"
#include "formats/bake_file/signal_envelope.h"
#include "formats/bake_file/signal_section.h"
#include "formats/files/file_kind.h"
#include "formats/files/random_access_file.h"
#include "formats/level/emitter.h"
#include "formats/level/mesh.h"
#include "formats/level/signal.h"

namespace clamor {

namespace {

constexpr std::uint64_t kMaxRoot_bytes = 1 << 30;  // enough for millions of emitters

constexpr const char* kAdvice = "Copy the file again or bake again.";

Error damaged(const std::string& what) { return Error(what + ". " + kAdvice); }

// `first` contains the first bytes of the file, at most the size of a preamble.
Result<Preamble> read_preamble(std::span<const std::byte> first, std::uint64_t file_bytes) {
  Preamble preamble;
  if (first.size() < kMagic.size() || std::memcmp(first.data(), kMagic.data(), 8) != 0) {
    const std::string other = other_kind(first, FileKind::kBake);
    return Error(other.empty() ? "is not a Clamor bake file; name a file that 'clamor bake' wrote"
                               : other);
  }
  if (first.size() < sizeof(preamble)) return damaged("is cut short");
  std::memcpy(&preamble, first.data(), sizeof(preamble));
  const auto copied = std::as_bytes(std::span(&preamble, 1));  // private copy, which cannot change
  // Checked before the checksum, because other major versions may have another layout.
  if (preamble.major != kFormatMajor)
    return Error("format " + std::to_string(preamble.major) + ", but this build reads format " +
                 std::to_string(kFormatMajor) + ". Update the player or bake again.");
  if (preamble.preamble_hash != hash_of(copied.first(kHashedPreambleBytes)))
    return damaged("its first 64 bytes fail their checksum");
  if (preamble.file_bytes != file_bytes)
    return damaged("is " + std::to_string(file_bytes) + " bytes long but was written with " +
                   std::to_string(preamble.file_bytes));
  if (preamble.root_offset % 8 != 0 || preamble.root_bytes % 8 != 0 ||
      preamble.root_offset < sizeof(preamble) || preamble.root_offset > file_bytes ||
      preamble.root_bytes > file_bytes - preamble.root_offset ||
      preamble.root_bytes > kMaxRoot_bytes)
    return damaged("its root lies outside the file or is too large");
  return preamble;
}

}  // namespace

struct BakeFile::State {
  explicit State(RandomAccessFile opened) : file(std::move(opened)) {}

  // Decodes a section and verifies its checksum before and after. May call decode() a second time
  // with a copy in `copy` (random_access_file.h). The Error is a predicate; `rejected` says whether
  // decode() returned it.
  template <class Decode>
  Result<void> decode(const FileSection& section, std::vector<std::byte>& copy,
                      const Decode& decode, bool* rejected = nullptr) const;

  // Sums a member over all depths of all trees.
  std::uint64_t over_depths(std::uint64_t OctreeDepth::*what) const {
    std::uint64_t sum = 0;
    for (const auto& depths : root.depths)
      for (const OctreeDepth& depth : depths) sum += depth.*what;
    return sum;
  }

  RandomAccessFile file;
  std::string path;
  Preamble preamble;
  Vec3 origin_m{};
  BakeRootContents root;
  std::vector<Emitter> emitters_with_portals;  // if there are virtual ones
  mutable PageParents parents;
  ObjectPool<PageReader> readers;
  SharedWhileUsed surfaces;
};

template <class Decode>
Result<void> BakeFile::State::decode(const FileSection& section, std::vector<std::byte>& copy,
                                     const Decode& decode, bool* rejected) const {
  const auto checked = [&](std::span<const std::byte> bytes, bool may_change) -> Result<void> {
    if (hash_of(bytes) != section.hash) return Error("fails its checksum");
    if (const auto done = decode(bytes); !done.ok()) {
      if (rejected != nullptr) *rejected = !may_change;  // bytes that may change are decoded again
      return done;
    }
    // The file may have been overwritten between checksum and decoding.
    if (may_change && hash_of(bytes) != section.hash) return Error("changed while it was read");
    return {};
  };
  return file.with(section.offset, section.bytes, copy, checked);
}

BakeFile::BakeFile(std::unique_ptr<State> state) : state_(std::move(state)) {}
BakeFile::BakeFile(BakeFile&&) noexcept = default;
BakeFile& BakeFile::operator=(BakeFile&&) noexcept = default;
BakeFile::~BakeFile() = default;

Result<BakeFile> BakeFile::open(const std::string& path, FileAccess access) {
  auto opened = RandomAccessFile::open(path, access);
  if (!opened.ok()) return opened.error();
  return open(std::move(*opened), path);
}

Result<BakeFile> BakeFile::open(SuppliedBytes bytes, const std::string& name) {
  return open(RandomAccessFile(std::move(bytes)), name);
}

Result<BakeFile> BakeFile::open(RandomAccessFile file, const std::string& path) {
  auto state = std::make_unique<State>(std::move(file));
  state->path = path;
  const std::uint64_t size = state->file.size();
  std::vector<std::byte> copy;
  Result<Preamble> preamble = Preamble{};
  bool rejected = false;
  const auto read =
      state->file.with(0, std::min<std::uint64_t>(size, sizeof(Preamble)), copy,
                       [&](std::span<const std::byte> bytes, bool may_change) -> Result<void> {
                         preamble = read_preamble(bytes, size);
                         rejected = !preamble.ok() && !may_change;
                         return preamble.ok() ? Result<void>() : preamble.error();
                       });
  if (!read.ok()) return (rejected ? read.error() : damaged(read.error().message)).in(path);
  state->preamble = *preamble;
  state->origin_m = unpacked_origin_m(preamble->origin);

  // The root is converted completely, so its bytes are not needed later.
  const FileSection where{preamble->root_offset, preamble->root_bytes, preamble->root_hash};
  Result<BakeRootContents> root = BakeRootContents{};
  const auto decoded = state->decode(
      where, copy,
      [&](std::span<const std::byte> bytes) -> Result<void> {
        root = read_bake_root(bytes, preamble->root_offset);
        return root.ok() ? Result<void>() : root.error();
      },
      &rejected);
  if (!decoded.ok())
    return damaged((rejected ? "" : "its root ") + decoded.error().message).in(path);
  state->root = std::move(*root);
  if (!state->root.portals.emitters.empty())
    state->emitters_with_portals =
        clamor::source_emitters(state->root.emitters, state->root.portals);
  for (const PageEntry& top : state->root.trees) state->parents.add_top(top);
  for (const StoredProbe& probe : state->root.probes.places) state->parents.add_top(probe.tree.top);
  for (const StoredTree& zone : state->root.probes.zones) state->parents.add_top(zone.top);
  return BakeFile(std::move(state));
}

const std::string& BakeFile::path() const { return state_->path; }
const FileVersion& BakeFile::version() const { return state_->file.version(); }
bool BakeFile::is_mapped() const { return state_->file.is_mapped(); }
std::uint16_t BakeFile::major() const { return state_->preamble.major; }
std::uint16_t BakeFile::minor() const { return state_->preamble.minor; }
const Vec3& BakeFile::origin_m() const { return state_->origin_m; }
const BakeSettings& BakeFile::settings() const { return state_->root.settings; }
const Provenance& BakeFile::provenance() const { return state_->root.provenance; }
const BakeStatistics& BakeFile::statistics() const { return state_->root.statistics; }
const std::vector<MovablePart>& BakeFile::movable_parts() const {
  return state_->root.movable_parts;
}
const std::vector<Material>& BakeFile::materials() const { return state_->root.materials; }
const std::vector<Emitter>& BakeFile::emitters() const { return state_->root.emitters; }
const std::vector<Emitter>& BakeFile::source_emitters() const {
  return state_->root.portals.emitters.empty() ? state_->root.emitters
                                               : state_->emitters_with_portals;
}
const std::vector<ImageSource>& BakeFile::images() const { return state_->root.images; }

const BakedPortals& BakeFile::portals() const { return state_->root.portals; }
const std::vector<PageEntry>& BakeFile::trees() const { return state_->root.trees; }
const std::vector<std::vector<OctreeDepth>>& BakeFile::depths() const {
  return state_->root.depths;
}
const std::vector<std::vector<std::uint32_t>>& BakeFile::signal_maps() const {
  return state_->root.signal_maps;
}
const PageEntry* BakeFile::top() const {
  return state_->root.trees.empty() ? nullptr : &state_->root.trees.back();
}
std::uint64_t BakeFile::source_count() const { return top() == nullptr ? 0 : top()->sources_below; }
const StoredProbes& BakeFile::probes() const { return state_->root.probes; }
std::uint64_t BakeFile::stored_sources() const {
  return state_->over_depths(&OctreeDepth::sources);
}
std::uint64_t BakeFile::page_count() const { return state_->over_depths(&OctreeDepth::nodes); }
std::size_t BakeFile::signal_count() const { return state_->root.signals.size(); }

BakeBytes BakeFile::bytes() const {
  BakeBytes bytes;
  bytes.file = state_->preamble.file_bytes;
  bytes.root = state_->preamble.root_bytes;
  bytes.pages = state_->over_depths(&OctreeDepth::packed_bytes);
  bytes.pages_unpacked = kColumnBytes * stored_sources();
  const auto add_probes = [&bytes](const StoredTree& tree) {
    for (const OctreeDepth& depth : tree.depths) bytes.probes += depth.packed_bytes;
  };
  for (const StoredProbe& probe : probes().places) add_probes(probe.tree);
  for (const StoredTree& zone : probes().zones) add_probes(zone);
  for (const StoredSignal& signal : state_->root.signals) {
    for (const FileSection& block : signal.blocks) bytes.signals += block.bytes;
    bytes.signals += signal.envelope.bytes;
  }
  for (const StoredGeometryPage& page : state_->root.geometry) bytes.geometry += page.section.bytes;
  return bytes;
}

Result<void> BakeFile::read_page(const PageEntry& entry, PageReader& reader,
                                 PageLinks& links) const {
  const auto failed = [&](const Error& error) {
    return damaged(state_->path + ": the page of " + std::to_string(entry.page.bytes()) +
                   " bytes at " + std::to_string(entry.page.offset) + " " + error.message);
  };
  const FileSection where{entry.page.offset, entry.page.bytes(), entry.page.hash};
  const PageContext around{state_->root.trees, state_->root.signal_maps.size(),
                           state_->root.emitters.size()};
  const auto done =
      state_->decode(where, reader.copy, [&](std::span<const std::byte> bytes) -> Result<void> {
        const auto frame = bytes.first(entry.page.packed_bytes);
        reader.columns.count = 0;
        if (!frame.empty())
          if (const auto decoded = reader.decoder.decode(
                  entry, frame, source_emitters(), state_->root.materials.size(), reader.columns,
                  entry.of_probe ? stored_first_legs(state_->root.portals) : 0);
              !decoded.ok())
            return decoded;
        return read_links(bytes.subspan(frame.size()), entry, around, links);
      });
  if (!done.ok()) return failed(done.error());
  const auto added = state_->parents.add(entry, links);
  return added.ok() ? added : failed(added.error());
}

void BakeFile::will_need(const PageEntry& entry) const {
  state_->file.will_need(entry.page.offset, entry.page.bytes());
}

Result<OctreePage> BakeFile::read_page(const PageEntry& entry) const {
  const auto reader = state_->readers.borrow();
  OctreePage page;
  if (const auto done = read_page(entry, *reader, page.links); !done.ok()) return done.error();
  page.sources = sources_of(reader->columns);
  return page;
}

Result<void> BakeFile::for_each_page(const Visit& visit) const {
  return for_each_page(trees(), visit);
}

Result<void> BakeFile::for_each_probe_page(const Visit& visit) const {
  std::vector<PageEntry> tops;
  for (const StoredProbe& probe : probes().places) tops.push_back(probe.tree.top);
  for (const StoredTree& zone : probes().zones) tops.push_back(zone.top);
  return for_each_page(tops, visit);
}

Result<void> BakeFile::for_each_page(const std::vector<PageEntry>& tops, const Visit& visit) const {
  struct Waiting {
    PageEntry entry;
    std::size_t depth;
  };
  for (std::size_t tree = 0; tree < tops.size(); ++tree) {
    std::vector<Waiting> waiting = {{tops[tree], 0}};
    while (!waiting.empty()) {
      const Waiting next = waiting.back();
      waiting.pop_back();
      const auto page = read_page(next.entry);
      if (!page.ok()) return page.error();
      if (const auto done = visit(next.entry, *page, tree, next.depth); !done.ok()) return done;
      const auto& children = page->links.children;
      for (auto child = children.rbegin(); child != children.rend(); ++child)
        waiting.push_back({*child, next.depth + 1});
    }
  }
  return {};
}

SignalInfo BakeFile::signal(std::size_t index) const {
  const StoredSignal& stored = state_->root.signals[index];
  return {stored.name, stored.loop, stored.frames, stored.blocks.size()};
}

Result<Signal> BakeFile::read_signal(std::size_t index) const {
  const StoredSignal& stored = state_->root.signals[index];
  Signal signal{stored.name, {}, stored.loop};
  for (std::size_t i = 0; i < stored.blocks.size(); ++i) {
    auto block = read_signal_block(index, i);
    if (!block.ok()) return block.error();
    if (i == 0)
      signal.samples = std::move(*block);
    else
      signal.samples.insert(signal.samples.end(), block->begin(), block->end());
  }
  return signal;
}

Result<std::vector<float>> BakeFile::read_signal_block(std::size_t index, std::size_t block) const {
  const StoredSignal& stored = state_->root.signals[index];
  std::string where = state_->path + ": signal " + in_quotes(stored.name);
  if (stored.blocks.size() > 1)
    where += " (block " + std::to_string(block + 1) + " of " +
             std::to_string(stored.blocks.size()) + ")";
  std::vector<std::byte> copy;
  Result<std::vector<float>> samples = std::vector<float>();
  const auto read = state_->decode(
      stored.blocks[block], copy, [&](std::span<const std::byte> flac) -> Result<void> {
        samples =
            unpack_signal_block(flac, signal_block(stored.frames, block).frames, stored.scale);
        return samples.ok() ? Result<void>() : samples.error();
      });
  if (!read.ok()) return damaged(where + " " + read.error().message);
  return samples;
}

Result<SignalEnvelope> BakeFile::read_envelope(std::size_t index) const {
  const StoredSignal& stored = state_->root.signals[index];
  const std::string where = state_->path + ": the envelope of signal " + in_quotes(stored.name);
  std::vector<std::byte> copy;
  Result<SignalEnvelope> envelope = Error("is empty");
  const auto read =
      state_->decode(stored.envelope, copy, [&](std::span<const std::byte> bytes) -> Result<void> {
        envelope = unpack_envelope(bytes, stored.frames, stored.mean_square);
        return envelope.ok() ? Result<void>() : envelope.error();
      });
  if (!read.ok()) return damaged(where + " " + read.error().message);
  return envelope;
}

std::size_t BakeFile::geometry_page_count() const { return state_->root.geometry.size(); }

GeometryPageInfo BakeFile::geometry_page(std::size_t index) const {
  const StoredGeometryPage& stored = state_->root.geometry[index];
  return {stored.section.offset, stored.section.bytes, stored.counts.vertices,
          stored.counts.triangles};
}

Result<Mesh> BakeFile::read_geometry_page(std::size_t index) const {
  const StoredGeometryPage& stored = state_->root.geometry[index];
  const auto failed = [&](const Error& error) {
    return damaged(state_->path + ": page " + std::to_string(index + 1) + " of " +
                   std::to_string(geometry_page_count()) + " of the geometry (" +
                   std::to_string(stored.section.bytes) + " bytes at " +
                   std::to_string(stored.section.offset) + ") " + error.message);
  };
  const auto unpack = stored.as_before_3_1 ? unpack_whole_geometry : unpack_geometry_page;
  std::vector<std::byte> copy;
  Result<Mesh> mesh = Mesh{};
  const auto read =
      state_->decode(stored.section, copy, [&](std::span<const std::byte> frame) -> Result<void> {
        mesh = unpack(frame, stored.counts, state_->root.geometry_low_m,
                      state_->root.materials.size());
        return mesh.ok() ? Result<void>() : mesh.error();
      });
  return read.ok() ? std::move(mesh) : failed(read.error());
}

SharedWhileUsed& BakeFile::surfaces() const { return state_->surfaces; }

Result<Mesh> BakeFile::read_mesh() const {
  Mesh mesh;
  for (std::size_t i = 0; i < geometry_page_count(); ++i) {
    const auto page = read_geometry_page(i);
    if (!page.ok()) return page;
    append(*page, mesh);
  }
  return mesh;
}

}  // namespace clamor
