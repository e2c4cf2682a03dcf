// bake_file.h: random access to the parts of a .clamor file. bake_format.md specifies the format.
//
// Cap'n Proto and zstd are visible only behind this header.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "common/platform/system_file.h"
#include "common/result.h"
#include "formats/bake_file/page_links.h"
#include "formats/files/file_access.h"

namespace clamor {

struct BakedPortals;  // baked_portals.h
struct ImageSource;   // image_source.h
struct BakeSettings;
struct BakeStatistics;
struct Emitter;
struct Material;
struct Mesh;
struct MovablePart;
struct Provenance;
struct Signal;
class SharedWhileUsed;
class SignalEnvelope;

class RandomAccessFile;
struct PageReader;
struct SuppliedBytes;  // formats/files/random_access_file.h

// Sizes of the parts of a file.
struct BakeBytes {
  std::uint64_t file = 0, root = 0, pages = 0, probes = 0, signals = 0, geometry = 0;
  std::uint64_t pages_unpacked = 0;
};

struct OctreePage {
  std::vector<Source> sources;
  PageLinks links;
};

// A part of the geometry that can be decoded on its own.
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

// An open bake file whose preamble and root have been validated. Pages, signals and geometry are
// decoded on demand.
//
// Threads: all const functions are thread-safe.
class BakeFile {
 public:
  // Checks the preamble and the root: sizes, offsets, counts, indices, floats and their checksums.
  // Pages, signals and geometry are checked when they are read. Allocates no more than a small
  // multiple of the size of the root. Later changes of the file are detected when a part is read
  // (random_access_file.h).
  static Result<BakeFile> open(const std::string& path, FileAccess access = FileAccess::kRead);
  // From bytes that the application supplies; `name` stands for the path in errors.
  static Result<BakeFile> open(SuppliedBytes bytes, const std::string& name);
  BakeFile(BakeFile&&) noexcept;
  BakeFile& operator=(BakeFile&&) noexcept;
  ~BakeFile();

  const std::string& path() const;
  const FileVersion& version() const;  // at opening; compare with file_version(path())
  bool is_mapped() const;
  std::uint16_t major() const;
  std::uint16_t minor() const;
  // In the world's coordinates; all others of the file but those of its findings are relative to it
  // (formats/level/level_origin.h).
  const Vec3& origin_m() const;
  const BakeSettings& settings() const;
  const Provenance& provenance() const;
  const BakeStatistics& statistics() const;
  const std::vector<Material>& materials() const;
  const std::vector<Emitter>& emitters() const;
  const std::vector<MovablePart>& movable_parts() const;
  // The emitters that sources refer to: emitters(), then the virtual ones of portals().
  const std::vector<Emitter>& source_emitters() const;
  const BakedPortals& portals() const;
  // Early specular paths of the first of emitters().
  const std::vector<ImageSource>& images() const;
  // The entry of the top node of each tree: instanced trees first, the level's tree last. Empty if
  // there are no sources.
  const std::vector<PageEntry>& trees() const;
  const std::vector<std::vector<OctreeDepth>>& depths() const;  // per tree
  const std::vector<std::vector<std::uint32_t>>& signal_maps() const;
  const StoredProbes& probes() const;
  const PageEntry* top() const;          // of the level's tree, or null
  std::uint64_t source_count() const;    // with emitters, each instance's counted
  std::uint64_t stored_sources() const;  // as stored: those of an instanced tree count once
  std::uint64_t page_count() const;
  BakeBytes bytes() const;

  // Decodes and validates a page: the sources of its node by descending key, and its links. Sources
  // are quantized (bake_format.md); emitters are exactly those of the emitter table, and refer to
  // source_emitters().
  Result<OctreePage> read_page(const PageEntry& entry) const;

  // Decodes a page into reader.columns, almost without allocating, for readers of many pages.
  Result<void> read_page(const PageEntry& entry, PageReader& reader, PageLinks& links) const;

  // Hints the kernel to prefetch the page. May block on the disk.
  void will_need(const PageEntry& entry) const;

  // Calls visit(entry, page, tree, depth) for every stored page, parents before their children.
  // Stops at the first Error.
  using Visit = std::function<Result<void>(const PageEntry& entry, const OctreePage& page,
                                           std::size_t tree, std::size_t depth)>;
  Result<void> for_each_page(const Visit& visit) const;
  // The same for the trees of probes: those of the places, then those of the zones.
  Result<void> for_each_probe_page(const Visit& visit) const;
  // The same for trees that have these pages at their tops.
  Result<void> for_each_page(const std::vector<PageEntry>& tops, const Visit& visit) const;

  std::size_t signal_count() const;
  SignalInfo signal(std::size_t index) const;
  Result<Signal> read_signal(std::size_t index) const;
  // Samples of one block (signal_section.h).
  Result<std::vector<float>> read_signal_block(std::size_t index, std::size_t block) const;
  Result<SignalEnvelope> read_envelope(std::size_t index) const;
  // Surfaces for occlusion rays, in pages of whole triangles.
  std::size_t geometry_page_count() const;
  GeometryPageInfo geometry_page(std::size_t index) const;
  // Triangles of one page, with their own vertices.
  Result<Mesh> read_geometry_page(std::size_t index) const;
  // Triangles of all pages. An Error if any cannot be read.
  Result<Mesh> read_mesh() const;

  // Holds the BVH and edges that the runtime makes of the geometry, while anybody uses them.
  SharedWhileUsed& surfaces() const;

 private:
  struct State;
  explicit BakeFile(std::unique_ptr<State> state);
  static Result<BakeFile> open(RandomAccessFile file, const std::string& path);
  std::unique_ptr<State> state_;
};

}  // namespace clamor
