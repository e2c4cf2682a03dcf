#include "formats/bake_file.h"

#include <algorithm>
#include <cstring>

#include "formats/audio_file.h"
#include "formats/bake_layout.h"
#include "formats/bake_root_reader.h"
#include "formats/geometry_section.h"
#include "formats/page.h"
#include "formats/read_file.h"

namespace clamor {

namespace {

constexpr std::uint64_t kMostRootBytes = 1 << 30;  // some 500 million sources' index

constexpr const char* kAdvice = "Copy the file again or bake again.";

Error damaged(const std::string& what) { return Error(what + ". " + kAdvice); }

// `first`: the file's first bytes, at most as many as a preamble has.
Result<Preamble> read_preamble(std::span<const std::byte> first, std::uint64_t file_bytes) {
  Preamble preamble;
  if (first.size() < kMagic.size() || std::memcmp(first.data(), kMagic.data(), 8) != 0)
    return Error("is not a Clamor bake file; name a file that 'clamor bake' wrote");
  if (first.size() < sizeof(preamble)) return damaged("is cut short");
  std::memcpy(&preamble, first.data(), sizeof(preamble));
  // Before the checksum: another major may lay out and sum these bytes in its own way.
  if (preamble.major != kFormatMajor)
    return Error("format " + std::to_string(preamble.major) + ", but this build reads format " +
                 std::to_string(kFormatMajor) + ". Update the player or bake again.");
  if (preamble.preamble_hash != hash_of(first.first(kHashedPreambleBytes)))
    return damaged("its first 64 bytes fail their checksum");
  if (preamble.file_bytes != file_bytes)
    return damaged("is " + std::to_string(file_bytes) + " bytes long but was written with " +
                   std::to_string(preamble.file_bytes));
  if (preamble.root_offset % 8 != 0 || preamble.root_bytes % 8 != 0 ||
      preamble.root_offset < sizeof(preamble) || preamble.root_offset > file_bytes ||
      preamble.root_bytes > file_bytes - preamble.root_offset ||
      preamble.root_bytes > kMostRootBytes)
    return damaged("its root lies outside the file or is too large");
  return preamble;
}

}  // namespace

struct BakeFile::State {
  explicit State(ReadFile opened) : file(std::move(opened)) {}

  // The section's bytes, checked.
  Result<void> read(const FileSection& section, std::vector<std::byte>& bytes) const;

  ReadFile file;
  std::string path;
  Preamble preamble;
  BakeRootContents root;
};

Result<void> BakeFile::State::read(const FileSection& section,
                                   std::vector<std::byte>& bytes) const {
  if (auto done = file.read(section.offset, section.bytes, bytes); !done.ok()) return done;
  if (hash_of(bytes) != section.hash) return Error("fails its checksum");
  return {};
}

BakeFile::BakeFile(std::unique_ptr<State> state) : state_(std::move(state)) {}
BakeFile::BakeFile(BakeFile&&) noexcept = default;
BakeFile& BakeFile::operator=(BakeFile&&) noexcept = default;
BakeFile::~BakeFile() = default;

Result<BakeFile> BakeFile::open(const std::string& path) {
  auto opened = ReadFile::open(path);
  if (!opened.ok()) return opened.error();
  auto state = std::make_unique<State>(std::move(*opened));
  state->path = path;
  const std::uint64_t size = state->file.size();
  std::vector<std::byte> bytes;
  if (const auto read = state->file.read(0, std::min<std::uint64_t>(size, sizeof(Preamble)), bytes);
      !read.ok())
    return damaged(read.error().message).in(path);
  const auto preamble = read_preamble(bytes, size);
  if (!preamble.ok()) return preamble.error().in(path);
  state->preamble = *preamble;

  const FileSection where{preamble->root_offset, preamble->root_bytes, preamble->root_hash};
  if (const auto read = state->read(where, bytes); !read.ok())
    return damaged("its root " + read.error().message).in(path);
  auto root = read_bake_root(bytes, preamble->root_offset);
  if (!root.ok()) return damaged(root.error().message).in(path);
  state->root = std::move(*root);
  return BakeFile(std::move(state));
}

const std::string& BakeFile::path() const { return state_->path; }
std::uint16_t BakeFile::major() const { return state_->preamble.major; }
std::uint16_t BakeFile::minor() const { return state_->preamble.minor; }
const BakeSettings& BakeFile::settings() const { return state_->root.settings; }
const Provenance& BakeFile::provenance() const { return state_->root.provenance; }
const BakeStatistics& BakeFile::statistics() const { return state_->root.statistics; }
const std::vector<Material>& BakeFile::materials() const { return state_->root.materials; }
const std::vector<Emitter>& BakeFile::emitters() const { return state_->root.emitters; }
const std::vector<OctreeNode>& BakeFile::nodes() const { return state_->root.nodes; }
std::uint64_t BakeFile::source_count() const { return state_->root.source_count; }
std::size_t BakeFile::page_count() const { return state_->root.pages.size(); }
std::size_t BakeFile::signal_count() const { return state_->root.signals.size(); }

BakeBytes BakeFile::bytes() const {
  BakeBytes bytes;
  bytes.file = state_->preamble.file_bytes;
  bytes.root = state_->preamble.root_bytes;
  for (std::size_t i = 0; i < state_->root.pages.size(); ++i) {
    bytes.pages += state_->root.pages[i].bytes;
    bytes.pages_unpacked += kColumnBytes * state_->root.nodes[i].source_count;
  }
  for (const StoredSignal& signal : state_->root.signals) bytes.signals += signal.section.bytes;
  bytes.geometry = state_->root.geometry.bytes;
  return bytes;
}

PageInfo BakeFile::page(std::size_t index) const {
  const std::uint32_t sources = state_->root.nodes[index].source_count;
  return {state_->root.pages[index].offset,
          static_cast<std::uint32_t>(state_->root.pages[index].bytes),
          static_cast<std::uint32_t>(kColumnBytes * sources), sources};
}

Result<void> BakeFile::read_page(std::size_t index, PageDecoder& decoder,
                                 PageColumns& columns) const {
  const auto failed = [&](const Error& error) {
    return damaged(state_->path + ": page " + std::to_string(index + 1) + " of " +
                   std::to_string(page_count()) + " (" +
                   std::to_string(state_->root.pages[index].bytes) + " bytes at " +
                   std::to_string(state_->root.pages[index].offset) + ") " + error.message);
  };
  thread_local std::vector<std::byte> frame;  // kept, as pages are read by the thousand
  if (const auto read = state_->read(state_->root.pages[index], frame); !read.ok())
    return failed(read.error());
  const auto done = decoder.decode(state_->root.nodes[index], frame, state_->root.emitters,
                                   state_->root.materials.size(), columns);
  return done.ok() ? done : failed(done.error());
}

Result<std::vector<Source>> BakeFile::read_page(std::size_t index) const {
  // Kept, as making them takes longer than a page does.
  thread_local PageDecoder decoder;
  thread_local const auto columns = std::make_unique<PageColumns>();
  const auto done = read_page(index, decoder, *columns);
  if (!done.ok()) return done.error();
  return sources_of(*columns);
}

Result<std::vector<Source>> BakeFile::read_all_sources() const {
  std::vector<Source> all;
  PageDecoder decoder;
  const auto columns = std::make_unique<PageColumns>();
  for (std::size_t i = 0; i < page_count(); ++i) {
    if (const auto done = read_page(i, decoder, *columns); !done.ok()) return done.error();
    for (std::size_t k = 0; k < columns->count; ++k) all.push_back(columns->source(k));
  }
  return all;
}

Result<Signal> BakeFile::read_signal(std::size_t index) const {
  const StoredSignal& stored = state_->root.signals[index];
  const std::string where = state_->path + ": signal " + in_quotes(stored.name);
  std::vector<std::byte> flac;
  if (const auto read = state_->read(stored.section, flac); !read.ok())
    return damaged(where + " " + read.error().message);
  auto samples = decode_audio(flac, stored.name);
  if (!samples.ok()) return samples.error().in(state_->path);
  if (samples->size() != stored.frames) return damaged(where + " has the wrong length");
  for (float& sample : *samples) sample *= stored.scale;
  return Signal{stored.name, std::move(*samples), stored.loop};
}

Result<Mesh> BakeFile::read_mesh() const {
  std::vector<std::byte> frame;
  if (const auto read = state_->read(state_->root.geometry, frame); !read.ok())
    return damaged(state_->path + ": the geometry " + read.error().message);
  auto mesh = unpack_geometry(frame, state_->root.geometry_counts, state_->root.materials.size());
  if (!mesh.ok()) return damaged(state_->path + ": " + mesh.error().message);
  return mesh;
}

}  // namespace clamor
