// page_benchmark.cpp: sources that one core decodes per second, and bytes per source on disk. They
// decide how fast a listener may move and how large a level may be.
//
// The violin room is baked to 200 000 sources and stored in these layouts, with the same values:
//
//   page            as in a bake file: zstd frame to columns of floats, everything validated
//   page_unpacked   the same without the frame
//   page_of_file    page, of the bake that CLAMOR_BAKE names, such as a stadium of 10 million
//                   sources
//   bytes_and_zstd  one column per byte of each value, zstd level 9: decompressed only, without
//                   decoding values or restoring the order (the pages of format 1)
//
// Counters: sources per second of CPU time, bytes per source. Results are compared with the bake's
// sources.
#include <cstdlib>
#include <fstream>
#include <memory>
#include <vector>

#include <benchmark/benchmark.h>

#include "bake/bake.h"
#include "formats/bake_file/bake_contents.h"
#include "formats/bake_file/bake_file.h"
#include "formats/bake_file/bake_layout.h"
#include "formats/bake_file/page.h"
#include "formats/bake_file/source_quantization.h"
#include "formats/gltf/level_import.h"
#include "tests/build_paths.h"

namespace clamor {
namespace {

struct Packed {
  BakeContents bake;
  std::vector<std::vector<std::byte>> pages, frames, byte_frames;
  std::vector<std::size_t> byte_sizes;
};

// Stores the values of a node's sources byte by byte, lowest bytes first, one column per byte.
std::vector<std::byte> as_byte_columns(std::span<const Source> sources, int mirror_bits) {
  std::vector<std::vector<std::uint32_t>> columns(19);
  for (const Source& source : sources) {
    const QuantizedSource code = quantized(source, mirror_bits);
    std::size_t c = 0;
    const auto put = [&](auto value) { columns[c++].push_back(static_cast<std::uint32_t>(value)); };
    for (const auto value : code.position) put(value);
    put(code.delay);
    for (const auto value : code.normal) put(value);
    for (const auto value : code.mirror) put(value);
    for (const auto value : code.power) put(value);
    put(code.radius);
    put(code.material);
    put(code.emitter);
  }
  std::vector<std::byte> bytes;
  for (const auto& column : columns)
    for (int k = 0; k < 4; ++k)
      for (const std::uint32_t value : column)
        bytes.push_back(static_cast<std::byte>(value >> 8 * k & 255));
  return bytes;
}

Packed packed_room() {
  auto imported =
      import_level(std::string(testing::kSourceDir) + "/assets/levels/violin_room.glb", {});
  if (!imported.ok()) std::abort();
  auto bake_of_it = bake(imported->level, {});
  if (!bake_of_it.ok()) std::abort();
  Packed room{std::move(*bake_of_it), {}, {}, {}, {}};
  const int mirror_bits = mirror_bits_for(room.bake.materials);
  for (const OctreeNode& node : room.bake.octree.nodes) {
    const auto sources =
        std::span(room.bake.octree.sources).subspan(node.first_source, node.source_count);
    room.pages.push_back(encode_page(node, sources, mirror_bits));
    room.frames.push_back(zstd_compress_fast(room.pages.back()));
    const auto bytes = as_byte_columns(sources, mirror_bits);
    room.byte_frames.push_back(packed(bytes));
    room.byte_sizes.push_back(bytes.size());
  }
  return room;
}

const Packed& room() {
  static const Packed packed = packed_room();
  return packed;
}

void count(benchmark::State& state, const std::vector<std::vector<std::byte>>& frames) {
  const auto sources = static_cast<double>(room().bake.octree.sources.size());
  std::size_t bytes = 0;
  for (const auto& frame : frames) bytes += frame.size();
  state.counters["bytes_per_source"] = static_cast<double>(bytes) / sources;
  state.counters["sources_per_s"] = benchmark::Counter(
      sources * static_cast<double>(state.iterations()), benchmark::Counter::kIsRate);
}

void decode(benchmark::State& state, bool from_frame) {
  const Packed& all = room();
  PageDecoder decoder;
  const auto columns = std::make_unique<PageColumns>();
  for (auto _ : state)
    for (std::size_t i = 0; i < all.frames.size(); ++i) {
      const OctreeNode& node = all.bake.octree.nodes[i];
      const auto done = from_frame ? decoder.decode(node, all.frames[i], all.bake.emitters,
                                                    all.bake.materials.size(), *columns)
                                   : decoder.decode_unpacked(node, all.pages[i], all.bake.emitters,
                                                             all.bake.materials.size(), *columns);
      if (!done.ok() || columns->u[0] != all.bake.octree.sources[node.first_source].u)
        state.SkipWithError("a page is not what was packed");
    }
  count(state, from_frame ? all.frames : all.pages);
}

void page(benchmark::State& state) { decode(state, true); }
void page_unpacked(benchmark::State& state) { decode(state, false); }

// Reads pages like a player, except for the disk: in the order of the file, and none twice before
// all others, so no decoded page is in the CPU's cache.
void page_of_file(benchmark::State& state) {
  const char* const path = std::getenv("CLAMOR_BAKE");
  if (path == nullptr) return state.SkipWithError("CLAMOR_BAKE names no file");
  const auto file = BakeFile::open(path);
  if (!file.ok()) return state.SkipWithError(file.error().message.c_str());
  struct Page {
    PageEntry entry;
    std::vector<std::byte> frame;
  };
  constexpr std::size_t kMaxPages = 20'000;
  std::vector<Page> pages;
  std::ifstream bytes(path, std::ios::binary);
  double sources = 0;
  const Error enough("enough");
  const auto visited = file->for_each_page([&](const PageEntry& entry, const OctreePage&,
                                               std::size_t, std::size_t) -> Result<void> {
    if (entry.source_count == 0) return {};
    if (pages.size() == kMaxPages) return enough;
    std::vector<std::byte> frame(entry.page.packed_bytes);
    bytes.seekg(static_cast<std::streamoff>(entry.page.offset));
    bytes.read(reinterpret_cast<char*>(frame.data()), static_cast<std::streamsize>(frame.size()));
    pages.push_back({entry, std::move(frame)});
    sources += entry.source_count;
    return {};
  });
  if (!visited.ok() && pages.size() < kMaxPages)
    return state.SkipWithError(visited.error().message.c_str());
  std::size_t packed_bytes = 0;
  for (const Page& page : pages) packed_bytes += page.frame.size();

  PageDecoder decoder;
  const auto columns = std::make_unique<PageColumns>();
  for (auto _ : state)
    for (const Page& page : pages)
      if (!decoder
               .decode(page.entry, page.frame, file->emitters(), file->materials().size(), *columns)
               .ok())
        state.SkipWithError("a page is not what was packed");
  state.counters["bytes_per_source"] = static_cast<double>(packed_bytes) / sources;
  state.counters["sources_per_page"] = sources / static_cast<double>(pages.size());
  state.counters["sources_per_s"] = benchmark::Counter(
      sources * static_cast<double>(state.iterations()), benchmark::Counter::kIsRate);
}

void bytes_and_zstd(benchmark::State& state) {
  const Packed& all = room();
  ZstdDecompressor unpacker;
  std::vector<std::byte> bytes(19 * 4 * kLeafSources);
  for (auto _ : state)
    for (std::size_t i = 0; i < all.byte_frames.size(); ++i) {
      const auto size = unpacker.unpack(all.byte_frames[i], bytes);
      if (!size.ok() || *size != all.byte_sizes[i]) state.SkipWithError("not what was packed");
    }
  count(state, all.byte_frames);
}

BENCHMARK(page)->Unit(benchmark::kMillisecond);
BENCHMARK(page_of_file)->Unit(benchmark::kMillisecond);
BENCHMARK(page_unpacked)->Unit(benchmark::kMillisecond);
BENCHMARK(bytes_and_zstd)->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace clamor
