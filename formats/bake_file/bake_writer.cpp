// bake_writer.cpp: implementation of bake_writer.h.
//
// Order: preamble, pages, children first, signals, geometry, root. The preamble is rewritten last.
#include "formats/bake_file/bake_writer.h"

#include <algorithm>

#include "common/platform/thread.h"
#include "common/thread_team.h"
#include "formats/audio/audio_file.h"
#include "formats/bake_file/bake_check.h"
#include "formats/bake_file/bake_contents.h"
#include "formats/bake_file/bake_layout.h"
#include "formats/bake_file/bake_root_reader.h"
#include "formats/bake_file/bake_root_writer.h"
#include "formats/bake_file/geometry_section.h"
#include "formats/bake_file/octree_writer.h"
#include "formats/bake_file/section_writer.h"
#include "formats/bake_file/signal_cache.h"
#include "formats/bake_file/source_quantization.h"
#include "formats/files/atomic_file.h"

namespace clamor {

namespace {

// Writes the instanced trees first, then the level's.
Result<void> write_trees(const BakeContents& contents, OctreeWriter& writer) {
  if (contents.octree.nodes.empty() && !contents.stream_octree) return {};
  for (const SourceOctree& tree : contents.prototypes)
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

Result<void> write_signal(const EncodedSignal& signal, SectionWriter& appender,
                          BakeSections& sections) {
  SignalSections& kept = sections.signals.emplace_back();
  kept.scale = signal.scale;
  for (const auto& block : signal.blocks) {
    const auto section = appender.append(block);
    if (!section.ok()) return section.error();
    kept.blocks.push_back(*section);
  }
  kept.mean_square = signal.mean_square;
  const auto section = appender.append(signal.envelope);
  if (!section.ok()) return section.error();
  kept.envelope = *section;
  return {};
}

Result<void> write_signals(const std::vector<Signal>& signals, SignalCache* cache,
                           SectionWriter& appender, BakeSections& sections) {
  if (cache != nullptr) {
    const auto encoded = cache->encode(signals);
    if (!encoded.ok()) return encoded.error();
    for (const auto& signal : *encoded)
      if (const auto done = write_signal(*signal, appender, sections); !done.ok()) return done;
    return {};
  }
  for (const Signal& signal : signals) {  // one in memory at a time
    const auto encoded = encode_signal(signal);
    if (!encoded.ok()) return encoded.error();
    if (const auto done = write_signal(*encoded, appender, sections); !done.ok()) return done;
  }
  return {};
}

Result<void> write_geometry(const Mesh& mesh, SectionWriter& appender, BakeSections& sections) {
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

Error unreadable(const Error& error) {
  return Error("is not written because it would be invalid: " + error.message);
}

Result<void> write_all(ByteSink& file, const BakeContents& contents, SignalCache* signals) {
  SectionWriter appender(file);
  BakeSections sections;
  if (const auto room = appender.append(std::vector<std::byte>(sizeof(Preamble))); !room.ok())
    return room.error();
  const PageContext around{{}, contents.signal_maps.size(), contents.emitters.size()};
  OctreeWriter pages(appender, mirror_bits_for(contents.materials), around);
  if (const auto done = write_trees(contents, pages); !done.ok()) return done;
  OctreeWriter probe_pages(appender, mirror_bits_for(contents.materials), around);
  for (const BakedProbe& probe : contents.probes.places)
    if (const auto done = probe_pages.write(probe.tree); !done.ok()) return done;
  for (const SourceOctree& zone : contents.probes.zones)
    if (const auto done = probe_pages.write(zone); !done.ok()) return done;
  if (const auto done = write_signals(contents.signals, signals, appender, sections); !done.ok())
    return done;
  if (const auto done = write_geometry(contents.mesh, appender, sections); !done.ok()) return done;
  if (const auto done = appender.align(); !done.ok()) return done;

  sections.bytes_before_root = appender.offset();
  const std::vector<std::byte> root =
      encode_bake_root(contents, sections, pages.trees(), probe_pages.trees());
  if (const auto readable = read_bake_root(root, appender.offset()); !readable.ok())
    return unreadable(readable.error()).in(file.path());
  const auto section = appender.append(root);
  if (!section.ok()) return section.error();

  Preamble preamble;
  preamble.major = kFormatMajor;
  preamble.minor = kFormatMinor;
  preamble.file_bytes = appender.offset();
  preamble.root_offset = section->offset;
  preamble.root_bytes = section->bytes;
  preamble.root_hash = section->hash;
  preamble.origin = packed_origin(contents.origin_m);
  if (unpacked_origin_m(preamble.origin) != contents.origin_m)
    return unreadable(Error("its origin is out of range, or no whole hundreds of metres"))
        .in(file.path());
  const auto bytes = std::as_bytes(std::span(&preamble, 1));
  preamble.preamble_hash = hash_of(bytes.first(kHashedPreambleBytes));
  return file.write_at(0, bytes);
}

Result<void> write_checked(ByteSink& file, const BakeContents& contents, int threads,
                           const std::atomic<bool>* stop, SignalCache* signals) {
  StoppableSink sink(file, stop);
  Result<void> done;
  with_team(std::min(threads, usable_cores()), [&] { done = write_all(sink, contents, signals); });
  return done;
}

}  // namespace

Result<void> write_bake(const std::string& path, const BakeContents& contents, int threads,
                        const std::atomic<bool>* stop, SignalCache* signals) {
  if (const auto sound = check_bake(contents); !sound.ok())
    return unreadable(sound.error()).in(path);
  auto file = AtomicFile::create(path);
  if (!file.ok()) return file.error();
  const auto done = write_checked(*file, contents, threads, stop, signals);
  return done.ok() ? file->commit() : done;
}

Result<std::vector<std::byte>> bake_bytes(const std::string& name, const BakeContents& contents,
                                          int threads, const std::atomic<bool>* stop,
                                          SignalCache* signals) {
  if (const auto sound = check_bake(contents); !sound.ok())
    return unreadable(sound.error()).in(name);
  MemorySink memory(name);
  if (const auto done = write_checked(memory, contents, threads, stop, signals); !done.ok())
    return done.error();
  return memory.take();
}

std::vector<std::string> file_library_versions() {
  std::vector<std::string> versions = {root_library_version(), zstd_version()};
  for (std::string& version : sound_library_versions()) versions.push_back(std::move(version));
  return versions;
}

}  // namespace clamor
