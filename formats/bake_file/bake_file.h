// bake_file.h: a .clamor file, written atomically, read part by part. bake_format.md specifies it.
//
// Cap'n Proto, zstd and xxHash are visible only behind this header.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "common/air.h"
#include "common/material.h"
#include "common/result.h"
#include "formats/bake_file/octree_sink.h"
#include "formats/bake_file/page_links.h"
#include "formats/bake_file/signal_envelope.h"
#include "formats/files/file_access.h"
#include "formats/files/input_file.h"
#include "formats/level/level.h"

namespace clamor {

class PageDecoder;
struct PageColumns;

inline constexpr std::uint16_t kFormatMajor = 3;
inline constexpr std::uint16_t kFormatMinor = 1;

// Everything that made the bake what it is. No clock, no thread count, no path: the same level
// and settings give the same bytes.
struct BakeSettings {
  std::uint64_t seed = 1;
  std::uint64_t photons = 0;  // 0: enough for the sources
  std::uint64_t sources = 0;  // most secondary sources to keep; 0: 200 000 for each room
  double roulette_exponent = 0.15;
  double longest_path_s = 10;
  Air air{};
};

struct Provenance {
  std::string tool;   // "clamor 0.1.0"
  std::string level;  // file name of the level
  std::uint64_t input_hash = 0;
  std::vector<std::string> arguments;  // of the command that made it, without level and output
  std::vector<std::string> libraries;  // "zstd 1.5.4", of those that decide what the bytes are
  std::vector<InputFile> inputs;       // in the order of reading
};

// How the sound of the level dies away, as the bake measured it at a few places.
struct DecaySummary {
  std::uint32_t places = 0;  // 0: not measured
  Bands t30_s{};             // mean of the places; 0 in bands that are too dry to tell
  Bands t30_error_s{};       // its standard error
  float error_db = 0;        // standard error of the decay curves; 0: unknown

  bool operator==(const DecaySummary&) const = default;
};

// What the tracing met, for inspect and for warnings.
struct BakeStatistics {
  std::uint64_t photons_traced = 0;
  std::uint64_t bounces = 0;
  std::uint64_t photons_escaped = 0;
  double mean_free_path_m = 0;  // over all legs between surfaces
  std::uint32_t rooms = 0;      // that the emitters are in, as far as they see each other
  std::uint64_t deposits = 0;   // that the photons left, before the weak ones were thinned
  Bands power_emitted{};        // by all emitters
  Bands power_escaped{};        // left the level
  Bands power_unfinished{};     // still under way at longest_path_s
  std::vector<std::string> warnings;
  DecaySummary decay{};
};

struct BakeContents {
  BakeSettings settings;
  Provenance provenance;
  BakeStatistics statistics;
  std::vector<Material> materials;
  std::vector<Emitter> emitters;
  std::vector<Signal> signals;
  Mesh mesh;  // for visibility rays
  SourceOctree octree;
  // Instead of octree where that would not fit into memory: hands the tree to the sink and returns
  // the handle of its top. Sources are then only checked as far as a page shows.
  std::function<Result<std::optional<std::size_t>>(OctreeSink&)> stream_octree;
  std::uint64_t streamed_sources = 0;
  std::uint64_t source_count() const { return octree.sources.size() + streamed_sources; }
  // Trees that instances copy: `tree` of an instance is an index here, and less than that of the
  // tree it stands in. octree may copy any.
  std::vector<SourceOctree> copied;
  std::vector<std::vector<std::uint32_t>> signal_maps;  // each with one entry per signal
};

// Writes PATH beside itself, syncs, renames. The bytes are a function of `contents` alone, whatever
// the number of `threads`. On failure nothing stays behind and an older file at PATH is untouched.
// What BakeFile::open() would refuse is refused here, by the same checks.
Result<void> write_bake(const std::string& path, const BakeContents& contents, int threads);

// "zstd 1.5.4" and so on: those whose next version may pack the same contents into other bytes.
std::vector<std::string> file_library_versions();

// Sizes of a file's parts, for inspect.
struct BakeBytes {
  std::uint64_t file = 0, root = 0, pages = 0, signals = 0, geometry = 0;
  std::uint64_t pages_unpacked = 0;
};

struct OctreePage {
  std::vector<Source> sources;
  PageLinks links;
};

// A part of the geometry, which can be decoded without the others.
struct GeometryPageInfo {
  std::uint64_t offset = 0, packed_bytes = 0;
  std::uint32_t vertices = 0, triangles = 0;
};

struct SignalInfo {
  std::string name;
  bool loop = false;
  std::uint64_t frames = 0;
  std::size_t blocks = 0;
};

// An open bake file: its preamble and root checked, nothing decoded yet.
//
// Threads: all const functions may be called from any thread at once.
class BakeFile {
 public:
  // Checks everything but page contents: sizes, offsets, counts, indices, links, floats and
  // checksums. Opening allocates no more than a small multiple of the root's size. What becomes of
  // the file later is met when a part is read: random_access_file.h compares the ways of access.
  static Result<BakeFile> open(const std::string& path, FileAccess access = FileAccess::kRead);
  BakeFile(BakeFile&&) noexcept;
  BakeFile& operator=(BakeFile&&) noexcept;
  ~BakeFile();

  const std::string& path() const;
  const FileVersion& version() const;  // that was opened; file_version(path()) tells a newer one
  bool is_mapped() const;
  std::uint16_t major() const;
  std::uint16_t minor() const;
  const BakeSettings& settings() const;
  const Provenance& provenance() const;
  const BakeStatistics& statistics() const;
  const std::vector<Material>& materials() const;
  const std::vector<Emitter>& emitters() const;
  // The tops of all trees: that of the level last, before it those it has copies of. Empty where
  // there are no sources.
  const std::vector<PageEntry>& trees() const;
  const std::vector<std::vector<OctreeLevel>>& levels() const;  // per tree
  const std::vector<std::vector<std::uint32_t>>& signal_maps() const;
  const PageEntry* top() const;          // of the level's tree, or null
  std::uint64_t source_count() const;    // emitters included, and every copy
  std::uint64_t stored_sources() const;  // each once
  std::uint64_t page_count() const;
  BakeBytes bytes() const;

  // Decodes one page, checked: its node's sources, by descending key, and its links. Quantised as
  // bake_format.md says; emitters exactly as in the emitter table.
  Result<OctreePage> read_page(const PageEntry& entry) const;

  // The same with columns, nearly without allocating: for those who read many.
  Result<void> read_page(const PageEntry& entry, PageDecoder& decoder, PageColumns& columns,
                         PageLinks& links) const;

  // Has the page fetched from the disk meanwhile, if it is not in memory. May wait for the disk.
  void will_need(const PageEntry& entry) const;

  // Calls visit(entry, page, tree, depth) for every stored page, parents before their children; the
  // first error ends it.
  using Visit = std::function<Result<void>(const PageEntry& entry, const OctreePage& page,
                                           std::size_t tree, std::size_t depth)>;
  Result<void> for_each_page(const Visit& visit) const;

  std::size_t signal_count() const;
  SignalInfo signal(std::size_t index) const;
  Result<Signal> read_signal(std::size_t index) const;
  // The samples of one block alone; signal_section.h says which they are.
  Result<std::vector<float>> read_signal_block(std::size_t index, std::size_t block) const;
  Result<SignalEnvelope> read_envelope(std::size_t index) const;
  // What sound cannot pass, in pages of whole triangles; in the order of the file.
  std::size_t geometry_page_count() const;
  GeometryPageInfo geometry_page(std::size_t index) const;
  // The triangles of one page, with vertices of their own.
  Result<Mesh> read_geometry_page(std::size_t index) const;
  // All pages together. The first that cannot be read is an error.
  Result<Mesh> read_mesh() const;

 private:
  struct State;
  explicit BakeFile(std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

}  // namespace clamor
